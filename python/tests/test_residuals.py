"""Files of `gapscope residuals`, read by the reference reader of MCAP."""

import csv

import numpy as np
import pytest

pytest.importorskip("mcap")


def test_mcap_has_an_index_that_plotters_read_by(case, command, tmp_path):
    from mcap.reader import SeekingReader

    command("residuals", case.robot, case.logs[0], "--to", "csv,mcap", "--out", tmp_path)
    with open(next(tmp_path.glob("*.csv"))) as file:
        rows = list(csv.DictReader(file))
    with open(next(tmp_path.glob("*.mcap")), "rb") as file:
        reader = SeekingReader(file)
        summary = reader.get_summary()
        assert {channel.topic for channel in summary.channels.values()} == {"/effort", "/nominal", "/residual_nominal"}
        assert summary.statistics.message_count == 3 * len(rows) and summary.chunk_indexes
        late = list(reader.iter_messages(topics="/nominal", start_time=round(float(rows[50]["time"]) * 1e9)))
        assert len(late) == len(rows) - 50
        _, _, message = late[0]
        # The last numbers of a JointState are its efforts.
        told = np.frombuffer(message.data[-16:], dtype="<f8")
        assert told == pytest.approx([float(rows[50][f"nominal.joint{i}"]) for i in (1, 2)], abs=1e-12)
