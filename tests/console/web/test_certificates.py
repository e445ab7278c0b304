"""The certificates by which phones know this machine: what they say, and when they are renewed."""

import ipaddress
import os
import stat
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from cryptography import x509
from cryptography.x509.oid import ExtendedKeyUsageOID

from dva_sim.console.web.certificate_files import AUTHORITY, LEAF, certificates, data_folder
from dva_sim.console.web.certificates import LEAF_DAYS, Hosts, Signed
from dva_sim.console.web.phones import NoCertificate

NOW = datetime(2030, 1, 1, tzinfo=UTC)
HOSTS = Hosts.of(["localhost", "127.0.0.1", "lab-pc", "192.168.1.7"])


def extension(signed: Signed, kind):
    return signed.certificate.extensions.get_extension_for_class(kind)


def leaf_in(folder: Path) -> Signed:
    return Signed.read((folder / LEAF).read_bytes())


def mode(path: Path) -> int:
    return stat.S_IMODE(path.stat().st_mode)


def test_a_leaf_names_this_machine_and_is_valid_for_at_most_397_days(tmp_path):
    kept = certificates(tmp_path, HOSTS, NOW)
    leaf = leaf_in(tmp_path)
    names = extension(leaf, x509.SubjectAlternativeName).value
    assert set(names.get_values_for_type(x509.DNSName)) == {"localhost", "lab-pc"}
    assert ipaddress.ip_address("192.168.1.7") in names.get_values_for_type(x509.IPAddress)
    certificate = leaf.certificate
    assert certificate.not_valid_before_utc < NOW
    days = certificate.not_valid_after_utc - certificate.not_valid_before_utc
    assert days <= timedelta(days=397)
    usage = extension(leaf, x509.ExtendedKeyUsage).value
    assert list(usage) == [ExtendedKeyUsageOID.SERVER_AUTH]
    assert not extension(leaf, x509.BasicConstraints).value.ca
    certificate.verify_directly_issued_by(kept.authority.certificate)
    assert kept.notices == ()


def test_an_authority_signs_no_other_and_nothing_on_the_internet(tmp_path):
    authority = certificates(tmp_path, HOSTS, NOW).authority
    basic = extension(authority, x509.BasicConstraints)
    assert (basic.critical, basic.value.ca, basic.value.path_length) == (True, True, 0)
    bound = extension(authority, x509.NameConstraints)
    allowed = bound.value.permitted_subtrees
    assert bound.critical
    networks = [one.value for one in allowed if isinstance(one, x509.IPAddress)]
    assert not any(ipaddress.ip_address("8.8.8.8") in network for network in networks)
    names = {one.value for one in allowed if isinstance(one, x509.DNSName)}
    assert names == {"localhost", "local", "lab-pc"}


def test_files_are_for_their_owner_alone(tmp_path):
    folder = tmp_path / "data" / "phones"
    old = os.umask(0)
    try:
        certificates(folder, HOSTS, NOW)
    finally:
        os.umask(old)
    assert mode(folder) == 0o700
    assert {mode(folder / name) for name in (AUTHORITY, LEAF)} == {0o600}
    assert {path.name for path in folder.iterdir()} == {AUTHORITY, LEAF}


def test_what_is_too_open_is_closed_again(tmp_path):
    certificates(tmp_path, HOSTS, NOW)
    (tmp_path / AUTHORITY).chmod(0o644)
    tmp_path.chmod(0o755)
    certificates(tmp_path, HOSTS, NOW)
    assert (mode(tmp_path), mode(tmp_path / AUTHORITY)) == (0o700, 0o600)


def test_both_are_kept_while_nothing_changes(tmp_path):
    certificates(tmp_path, HOSTS, NOW)
    before = [(tmp_path / name).read_bytes() for name in (AUTHORITY, LEAF)]
    fewer = Hosts.of(["localhost", "192.168.1.7"])
    assert certificates(tmp_path, fewer, NOW + timedelta(days=300)).notices == ()
    assert [(tmp_path / name).read_bytes() for name in (AUTHORITY, LEAF)] == before


@pytest.mark.parametrize(
    ("later", "hosts", "why"),
    [
        (timedelta(days=LEAF_DAYS - 29), HOSTS, "it ends soon"),
        (timedelta(days=LEAF_DAYS + 1), HOSTS, "it has expired"),
        (timedelta(days=-1), HOSTS, "it is not valid yet"),
        (timedelta(0), Hosts.of(["localhost", "10.0.0.9"]), "other names or addresses"),
    ],
)
def test_a_leaf_is_renewed_by_the_same_authority_and_that_is_told_in_a_line(
    tmp_path, later, hosts, why
):
    first = certificates(tmp_path, HOSTS, NOW)
    serial = leaf_in(tmp_path).certificate.serial_number
    kept = certificates(tmp_path, hosts, NOW + later)
    assert kept.authority.der == first.authority.der
    assert leaf_in(tmp_path).certificate.serial_number != serial
    assert len(kept.notices) == 1
    assert why in kept.notices[0]
    assert "\n" not in kept.notices[0]


@pytest.mark.parametrize(
    "hosts", [Hosts.of(["localhost", "lab-pc", "other-pc"]), Hosts.of(["lab-pc", "8.8.8.8"])]
)
def test_an_authority_that_may_not_sign_for_this_machine_is_renewed(tmp_path, hosts):
    first = certificates(tmp_path, HOSTS, NOW)
    kept = certificates(tmp_path, hosts, NOW)
    assert kept.authority.der != first.authority.der
    assert "trust" in kept.notices[0]
    leaf_in(tmp_path).certificate.verify_directly_issued_by(kept.authority.certificate)


@pytest.mark.parametrize("name", [AUTHORITY, LEAF])
@pytest.mark.parametrize("damage", [b"", b"rubbish", b"-----BEGIN CERTIFICATE-----\nAAAA\n"])
def test_a_broken_file_is_made_again_and_told_in_a_line(tmp_path, name, damage):
    certificates(tmp_path, HOSTS, NOW)
    (tmp_path / name).write_bytes(damage)
    kept = certificates(tmp_path, HOSTS, NOW)
    assert len([line for line in kept.notices if name in line]) == 1
    leaf_in(tmp_path).certificate.verify_directly_issued_by(kept.authority.certificate)


def test_a_key_of_another_certificate_is_broken(tmp_path):
    certificates(tmp_path / "a", HOSTS, NOW)
    certificates(tmp_path / "b", HOSTS, NOW)
    one, other = ((tmp_path / name / LEAF).read_bytes() for name in "ab")
    mark = b"-----BEGIN CERTIFICATE"
    (tmp_path / "a" / LEAF).write_bytes(one[: one.index(mark)] + other[other.index(mark) :])
    assert len(certificates(tmp_path / "a", HOSTS, NOW).notices) == 1


def test_a_folder_that_cannot_be_written_is_told_in_a_line(tmp_path):
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(NoCertificate, match="file") as error:
        certificates(tmp_path / "file" / "phones", HOSTS, NOW)
    assert "\n" not in str(error.value)


def test_the_data_folder_is_where_the_system_wants_it(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    assert data_folder() == tmp_path / "dva-sim"
    monkeypatch.setenv("XDG_DATA_HOME", "not/absolute")
    assert data_folder().is_absolute()


def test_names_and_addresses_are_told_apart():
    hosts = Hosts.of(["Lab-PC.", "::1", "fe80::1%eth0", "", "n\u00e4me"])
    assert hosts.names == {"lab-pc"}
    assert {str(one) for one in hosts.addresses} == {"::1", "fe80::1"}
