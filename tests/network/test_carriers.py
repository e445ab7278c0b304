"""Carriers of a run over real connections, and options refused in one line."""

import pytest
from helpers.wording import unnamed

from dva_sim.cli.program import call
from dva_sim.kernel.errors import ConfigError
from dva_sim.network.carriers import carrier_of


@pytest.mark.parametrize(
    ("given", "names"),
    [
        (["udp"], ("udp", "zeromq", "mqtt")),
        (["mqtt", "zeromq"], ("zeromq",)),
        (["qos=1"], ("qos", "mqtt")),
        (["mqtt", "qos=3"], ("qos", "3")),
        (["mqtt", "broker=here"], ("broker", "near", "far")),
        (["mqtt", "port=1"], ("port", "broker")),
    ],
)
def test_a_carrier_that_cannot_be_is_refused_in_one_line(given, names):
    with pytest.raises(ConfigError) as refused:
        carrier_of(given)
    assert unnamed(str(refused.value), "--transport", *names) == []


def test_a_broker_has_no_keys_and_stays_on_this_machine():
    mqtt = carrier_of(["mqtt"])
    with pytest.raises(ConfigError, match="--keys"):
        mqtt.check(["127.0.0.1"], has_keys=True)
    with pytest.raises(ConfigError, match=r"192\.168\.1\.5"):
        mqtt.check(["127.0.0.1", "192.168.1.5"], has_keys=False)
    carrier_of([]).check(["192.168.1.5"], has_keys=True)


def test_without_mosquitto_a_line_says_so(monkeypatch):
    monkeypatch.setattr("dva_sim.network.middleware.ends.find_spec", lambda name: name)
    monkeypatch.setattr("dva_sim.network.middleware.ends.shutil.which", lambda name: None)
    with pytest.raises(ConfigError, match="mosquitto"):
        carrier_of(["mqtt"]).check([], has_keys=False)


def test_without_its_library_a_line_says_so(monkeypatch):
    monkeypatch.setattr("dva_sim.network.middleware.ends.find_spec", lambda name: None)
    with pytest.raises(ConfigError, match=r"\[mqtt\]"):
        carrier_of(["mqtt"]).check([], has_keys=False)


@pytest.mark.parametrize(
    ("words", "names"),
    [
        (["--transport", "mqtt", "--keys", "keys"], ("--keys", "mqtt")),
        (["--transport", "mqtt", "--host", "0.0.0.0"], ("mqtt", "0.0.0.0")),
        (["--transport", "mqtt", "--dva", "10.1.2.3:1883"], ("mqtt", "10.1.2.3")),
        (["--transport", "dds"], ("dds", "zeromq", "mqtt")),
    ],
)
def test_what_mqtt_cannot_do_is_refused_in_one_line(words, names, capsys):
    assert call(["live", "drive-to-event", *words]) == 2
    assert unnamed(capsys.readouterr().err, *names) == []
