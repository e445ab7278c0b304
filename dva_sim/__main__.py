"""`python -m dva_sim` is `dva-sim`: what has to be done before all else, and then the program."""

from typing import NoReturn

from dva_sim.kernel import early_stop


def main() -> NoReturn:
    """Entry point: `dva-sim`."""
    early_stop.end_at_once()
    # Late imports, so that Ctrl-C is heard meanwhile.
    from dva_sim.kernel.rare_collection import collect_rarely

    collect_rarely()
    from dva_sim.cli import main as program

    program()


if __name__ == "__main__":
    main()
