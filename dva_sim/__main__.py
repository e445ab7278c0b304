"""`python -m dva_sim` is `dva-sim`: what has to be done before all else, and then the program."""

from typing import NoReturn

from dva_sim.kernel import early_stop


def main() -> NoReturn:
    """Run `dva-sim`."""
    early_stop.end_at_once()
    from dva_sim.kernel.rare_collection import collect_rarely  # late: start-up, for Ctrl-C

    collect_rarely()
    from dva_sim.cli import main as program  # late: start-up, so that Ctrl-C is heard meanwhile

    program()


if __name__ == "__main__":
    main()
