"""A recording as others read it: the TypeScript implementation of MCAP, where it is installed."""

import json
import shutil
import sys
from pathlib import Path

import pytest
from helpers.processes import patience
from mcap.reader import make_reader

READ = """
const core = require("@mcap/core"), fzstd = require("fzstd"), fs = require("fs");
const bytes = fs.readFileSync(process.argv[1]), counts = {}, attached = [];
const readable = {
  size: async () => BigInt(bytes.length),
  read: async (at, n) => new Uint8Array(bytes.subarray(Number(at), Number(at + n))),
};
const zstd = (data, size) => fzstd.decompress(data, new Uint8Array(Number(size)));
(async () => {
  const handlers = { decompressHandlers: { zstd } };
  const reader = await core.McapIndexedReader.Initialize({ readable, ...handlers });
  for await (const message of reader.readMessages()) {
    const topic = reader.channelsById.get(message.channelId).topic;
    counts[topic] = (counts[topic] || 0) + 1;
  }
  for await (const each of reader.readAttachments()) attached.push(each.name);
  console.log(JSON.stringify({ counts, attached }));
})();
"""


@pytest.mark.system
def test_another_implementation_counts_the_same_messages(folder, monkeypatch):
    node, packages = shutil.which("node"), Path(sys.prefix) / "node_modules"
    if node is None or not (packages / "@mcap" / "core").is_dir():
        pytest.skip("node with @mcap/core and fzstd is missing (make tools)")
    monkeypatch.setenv("NODE_PATH", str(packages))
    command = [node, "-e", READ, str(folder / "drill.mcap")]
    output = json.loads(patience.run(command, capture_output=True, check=True).stdout)
    with (folder / "drill.mcap").open("rb") as file:
        summary = make_reader(file).get_summary()
        assert output["attached"] == [a.name for a in make_reader(file).iter_attachments()]
    counts = summary.statistics.channel_message_counts
    assert output["counts"] == {summary.channels[n].topic: count for n, count in counts.items()}
