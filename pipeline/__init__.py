"""The command line, the case file, the artifact store, reruns, progress and figures."""
