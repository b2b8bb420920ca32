// The 3D view of the part: three.js from the page itself, arrays from the element "model".
"use strict";

(() => {
  window.addEventListener("beforeprint", () => {
    for (const folded of document.querySelectorAll("details")) folded.open = true;
  });

  const source = document.getElementById("model");
  if (!source) return;
  const viewer = document.getElementById("viewer");
  const canvas = viewer.querySelector("canvas");
  const still = viewer.querySelector("img");
  const note = document.getElementById("viewer-note");
  const controls = document.getElementById("viewer-controls");
  const legend = document.getElementById("viewer-legend");

  const fallBack = (reason) => {
    canvas.hidden = true;
    controls.hidden = true;
    still.hidden = false;
    legend.hidden = true;
    viewer.dataset.state = "still";
    note.textContent = `${reason} This is a still picture.`;
  };

  const bytes = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const model = JSON.parse(source.textContent);

  let renderer;
  try {
    renderer = new THREE.WebGLRenderer({ canvas, antialias: true, alpha: true });
  } catch {
    fallBack("This browser offers no WebGL.");
    return;
  }
  canvas.addEventListener("webglcontextlost", () => fallBack("The graphics system gave up."));

  const extent = model.high.map((value, axis) => value - model.low[axis]);
  const places = (text) => {
    const raw = new Uint16Array(bytes(text).buffer);
    return Float32Array.from(raw, (value, index) => model.low[index % 3] + (value / 65535) * extent[index % 3]);
  };
  const triangles = new Uint32Array(bytes(model.triangles).buffer);

  const colours = bytes(model.colours);
  const steps = colours.length / 3;
  const palette = Array.from({ length: steps }, (_, step) =>
    new THREE.Color().setRGB(...[0, 1, 2].map((part) => colours[3 * step + part] / 255), THREE.SRGBColorSpace));
  const values = bytes(model.values);
  const painted = new Float32Array(3 * values.length);
  values.forEach((value, vertex) => palette[Math.round((value / 255) * (steps - 1))].toArray(painted, 3 * vertex));

  const sectionPlane = new THREE.Plane(new THREE.Vector3(0, 1, 0), 0);
  const scene = new THREE.Scene();
  const body = (text, vertexColours) => {
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.BufferAttribute(places(text), 3));
    geometry.setAttribute("color", new THREE.BufferAttribute(painted, 3));
    geometry.setIndex(new THREE.BufferAttribute(triangles, 1));
    geometry.computeVertexNormals();
    const outside = new THREE.MeshLambertMaterial({
      color: vertexColours ? 0xffffff : model.body, vertexColors: vertexColours, side: THREE.FrontSide,
    });
    // Seen through the cut, the inside of the solid is what a cap would cover.
    const inside = new THREE.MeshBasicMaterial({ color: 0xe8a33d, side: THREE.BackSide, visible: false });
    const meshes = [outside, inside].map((material) => new THREE.Mesh(geometry, material));
    meshes.forEach((mesh) => scene.add(mesh));
    return { meshes, outside, inside };
  };
  const states = { rest: body(model.rest, false), moved: body(model.moved, true) };

  scene.add(new THREE.AmbientLight(0xffffff, 0.8));
  const camera = new THREE.OrthographicCamera();
  camera.up.set(0, 0, 1);
  const lamp = new THREE.DirectionalLight(0xffffff, 2.7);
  lamp.position.set(0.5, 0.8, 1);
  camera.add(lamp);
  scene.add(camera);

  const centre = new THREE.Vector3(...model.low.map((value, axis) => value + extent[axis] / 2));
  const reach = Math.hypot(...extent) / 2;
  const orbit = new THREE.OrbitControls(camera, canvas);
  orbit.enablePan = false;
  orbit.minZoom = 0.5;
  orbit.maxZoom = 12;

  const draw = () => renderer.render(scene, camera);
  const home = () => {
    camera.position.copy(centre).add(new THREE.Vector3(1, -1.3, 0.75).setLength(4 * reach));
    camera.zoom = 1;
    camera.near = 0.1 * reach;
    camera.far = 10 * reach;
    orbit.target.copy(centre);
    resize();
    orbit.update();
    draw();
  };
  const resize = () => {
    const { clientWidth: width, clientHeight: height } = viewer;
    if (!width || !height) return;
    renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    renderer.setSize(width, height, false);
    const span = 0.82 * reach / Math.min(1, width / height);
    camera.top = span;
    camera.bottom = -span;
    camera.right = (span * width) / height;
    camera.left = -camera.right;
    camera.updateProjectionMatrix();
    draw();
  };

  const choose = () => {
    const wanted = controls.querySelector("input[name=state]:checked").value;
    const cut = document.getElementById("viewer-cut").checked;
    for (const [name, state] of Object.entries(states)) {
      state.meshes.forEach((mesh) => { mesh.visible = name === wanted; });
      for (const material of [state.outside, state.inside]) material.clippingPlanes = cut ? [sectionPlane] : [];
      state.inside.visible = cut;
    }
    legend.hidden = wanted !== "moved";
    viewer.dataset.state = wanted;
    draw();
  };

  const turn = (sideways, up) => {
    const arm = camera.position.clone().sub(centre);
    const level = Math.hypot(arm.x, arm.y);
    const around = Math.atan2(arm.y, arm.x) + sideways;
    const height = Math.max(-1.5, Math.min(1.5, Math.atan2(arm.z, level) + up));
    const far = arm.length();
    camera.position.set(
      centre.x + far * Math.cos(height) * Math.cos(around),
      centre.y + far * Math.cos(height) * Math.sin(around),
      centre.z + far * Math.sin(height));
    orbit.update();
    draw();
  };
  const zoom = (factor) => {
    camera.zoom = Math.max(orbit.minZoom, Math.min(orbit.maxZoom, camera.zoom * factor));
    camera.updateProjectionMatrix();
    draw();
  };
  const keys = {
    ArrowLeft: () => turn(-0.1, 0), ArrowRight: () => turn(0.1, 0), ArrowUp: () => turn(0, 0.1),
    ArrowDown: () => turn(0, -0.1), "+": () => zoom(1.2), "-": () => zoom(1 / 1.2), Home: home,
  };
  canvas.addEventListener("keydown", (event) => {
    const act = keys[event.key];
    if (!act || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    act();
  });

  renderer.localClippingEnabled = true;
  canvas.hidden = false;
  controls.hidden = false;
  still.hidden = true;
  note.textContent = "Drag to turn, scroll or pinch to zoom; with the keyboard: arrows, + and −, Home.";
  controls.addEventListener("change", choose);
  document.getElementById("viewer-home").addEventListener("click", home);
  orbit.addEventListener("change", draw);
  new ResizeObserver(resize).observe(viewer);
  home();
  choose();
})();
