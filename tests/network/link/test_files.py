"""Links from files: of their own keys, or part of a scenario."""

from dva_sim.network.link import LinkConfig
from dva_sim.network.link.files import read_link

ENDS = ("near", "far")


def test_a_link_is_read_from_its_keys_or_from_a_scenario(tmp_path):
    (tmp_path / "link.yaml").write_text("delay_s: 0.2\nup: {loss: 0.1}\n")
    (tmp_path / "run.yaml").write_text("horizon_s: 60\nlink:\n  delay_s: 0.2\n  up: {loss: 0.1}\n")
    given = LinkConfig.model_validate({"delay_s": 0.2, "up": {"loss": 0.1}})
    (tmp_path / "part.yaml").write_text("link:\n  delay_s: 0.2\n  up: {loss: 0.1}\n")
    for name in ("link.yaml", "run.yaml", "part.yaml"):
        assert read_link(str(tmp_path / name), {}, ENDS) == given
    changed = read_link(str(tmp_path / "run.yaml"), {"up.loss": 0.3, "rate_bps": 1e6}, ENDS)
    assert (changed.toward("up").loss, changed.toward("down").loss) == (0.3, 0.0)
    assert read_link("drive-to-event", {}, ENDS) == read_link(None, {}, ENDS) == LinkConfig()
