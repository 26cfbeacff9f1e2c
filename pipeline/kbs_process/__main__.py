"""`python -m kbs_process`."""

from kbs_process.cli import main

if __name__ == "__main__":
    main()
