"""``python -m poro``, and what the command ``poro`` runs."""

from pipeline.cli.app import main

if __name__ == "__main__":
    main()
