"""`python -m dva_sim.cli` is `dva-sim`."""

from dva_sim.__main__ import main

if __name__ == "__main__":
    main()
