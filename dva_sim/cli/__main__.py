"""`python -m dva_sim.cli` is `dva-sim`."""

from dva_sim.cli import main

if __name__ == "__main__":
    main()
