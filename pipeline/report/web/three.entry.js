export {
  AmbientLight, BufferAttribute, BufferGeometry, Color, DirectionalLight, Mesh, MeshBasicMaterial,
  MeshLambertMaterial, OrthographicCamera, Plane, Scene, SRGBColorSpace, Vector3, WebGLRenderer,
  BackSide, FrontSide,
} from "three";
export { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
