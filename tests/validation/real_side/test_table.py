import json
from pathlib import Path

import pytest

from dva_sim.kernel.errors import ConfigError
from dva_sim.validation.network.real_side.measuring import Table

COLUMNS = ("cell", "age")


@pytest.fixture
def path(tmp_path: Path) -> Path:
    with Table(tmp_path / "sub" / "own.csv", COLUMNS) as table:
        table.append({"cell": "one", "age": "5"})
        table.append({"cell": "two, three", "age": ""})
    return tmp_path / "sub" / "own.csv"


def test_rows_are_there_as_soon_as_they_are_appended(path):
    assert path.read_text() == 'cell,age\none,5\n"two, three",\n'


def test_a_table_that_is_opened_again_knows_its_rows(path):
    with Table(path, COLUMNS) as table:
        assert table.rows == [{"cell": "one", "age": "5"}, {"cell": "two, three", "age": ""}]


def test_half_a_row_of_a_killed_writer_is_cut_off(path):
    whole = path.read_text()
    for length in range(1, len("three,7")):
        path.write_text(whole + "three,7"[:length])
        with Table(path, COLUMNS) as table:
            assert len(table.rows) == 2
        assert path.read_text() == whole


def test_half_a_header_is_written_again(path):
    path.write_text("cell,a")
    with Table(path, COLUMNS) as table:
        assert table.rows == []
    assert path.read_text() == "cell,age\n"


def test_two_campaigns_cannot_write_to_one_table(path):
    with Table(path, COLUMNS), pytest.raises(ConfigError, match="by another campaign"):
        Table(path, COLUMNS)


def test_the_machine_stands_beside_the_table(path):
    with Table(path, COLUMNS) as table:
        table.sign({"cores": 2, "libzmq": "4.3.5"})
        table.sign({"cores": 2, "libzmq": "4.3.5"})
    assert json.loads(path.with_suffix(".machine.json").read_text())["cores"] == 2


def test_rows_of_two_machines_do_not_meet_in_one_table(path):
    with Table(path, COLUMNS) as table:
        table.sign({"cores": 2, "libzmq": "4.3.5"})
        with pytest.raises(ConfigError, match="cores was 2, is 8"):
            table.sign({"cores": 8, "libzmq": "4.3.5"})
