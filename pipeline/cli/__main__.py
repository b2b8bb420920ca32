"""``python -m pipeline.cli`` is ``poro``."""

from pipeline.cli.app import main

main()
