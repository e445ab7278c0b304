"""Tables as files that other programs read."""

import csv

import numpy as np
import pytest

from dva_sim.experiments.results.export import export
from dva_sim.kernel.errors import ConfigError


def rows_of(path):
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def test_a_folder_takes_every_table_and_what_the_columns_mean(results, tmp_path):
    written = export(results, tmp_path / "all")
    assert [path.name for path in written] == ["runs.csv", "tracks.csv", "columns.csv"]
    explained = {row["column"]: row["unit"] for row in rows_of(tmp_path / "all" / "columns.csv")}
    assert explained["t_s"] == "s"
    assert set(results.runs) < set(explained)


def test_csv_holds_every_number_to_its_last_bit(results, tmp_path):
    (path,) = export(results, tmp_path / "runs.csv")
    rows = rows_of(path)
    assert [float(row["drive_time_s"]) for row in rows] == results.runs["drive_time_s"].tolist()
    assert [int(row["seed"]) for row in rows] == results.runs["seed"].tolist()


def test_what_is_missing_is_empty_in_csv(results, tmp_path):
    (path,) = export(results, tmp_path / "runs.csv")
    empty = [row["round_trip_s"] == "" for row in rows_of(path)]
    assert empty == np.isnan(results.runs["round_trip_s"]).tolist()
    assert {row["pattern"] for row in rows_of(path) if row["is_reference"] == "true"} == {""}


def test_parquet_is_the_file_as_it_is(results, tmp_path):
    (path,) = export(results, tmp_path / "ways.parquet", ["tracks"])
    assert path.read_bytes() == results.path_of("tracks").read_bytes()


def test_the_same_results_give_the_same_bytes(results, tmp_path):
    first, second = (export(results, tmp_path / name) for name in ("one", "two"))
    assert [path.read_bytes() for path in first] == [path.read_bytes() for path in second]


def test_nothing_is_replaced_unless_asked_for(results, tmp_path):
    path = tmp_path / "runs.csv"
    path.write_text("mine")
    with pytest.raises(ConfigError, match=r"runs\.csv .*--overwrite"):
        export(results, path)
    assert path.read_text() == "mine"
    export(results, path, overwrite=True)
    assert path.read_text().startswith("part,cell")


def test_one_file_in_the_way_leaves_all_unwritten(results, tmp_path):
    (tmp_path / "tracks.parquet").write_text("mine")
    with pytest.raises(ConfigError, match="would be replaced"):
        export(results, tmp_path, form="parquet")
    assert [path.name for path in tmp_path.iterdir()] == ["tracks.parquet"]
