"""Certificates by which a phone knows this machine: an authority of our own, and what it signs.

Browsers give motion sensors to pages over https alone. No public authority signs an address of a
local network, so the program has an authority of its own, which the phone's owner trusts once. It
can do no harm elsewhere: it signs no other authority, and it counts for this machine's names and
for addresses that are never on the internet, for nothing else (RFC 5280, 4.2.1.9 and 4.2.1.10).
"""

from __future__ import annotations

import ipaddress
from dataclasses import dataclass
from datetime import datetime, timedelta

from cryptography import x509
from cryptography.exceptions import InvalidSignature
from cryptography.hazmat.primitives import hashes
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.serialization import (
    Encoding,
    NoEncryption,
    PrivateFormat,
    load_pem_private_key,
)
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

LEAF_DAYS, AUTHORITY_DAYS = 396, 3650  # browsers refuse a server's that is valid beyond 397
SPARE_DAYS = 30  # before the end it is renewed
BACKDATED = timedelta(hours=12)  # a phone's clock may be late
PRIVATE = ("10.0.0.0/8", "100.64.0.0/10", "127.0.0.0/8", "169.254.0.0/16", "172.16.0.0/12",
           "192.168.0.0/16", "::1/128", "fc00::/7", "fe80::/10")  # fmt: skip
LOCAL_NAMES = ("localhost", "local")  # what ends with the second is found by mDNS (RFC 6762)

Address = ipaddress.IPv4Address | ipaddress.IPv6Address


@dataclass(frozen=True)
class Hosts:
    """Under what a machine is reached.

    Attributes:
        names: Such as `lab-pc`, in lower case.
        addresses: IP addresses of the machine.
    """

    names: frozenset[str]
    addresses: frozenset[Address]

    @classmethod
    def of(cls, hosts: list[str]) -> Hosts:
        """Return names and addresses, sorted out; what can be neither is left out."""
        names = set()
        addresses = set()
        for one in hosts:
            try:
                addresses.add(ipaddress.ip_address(one.strip("[]").partition("%")[0]))
            except ValueError:
                if one.isascii() and one and len(one) < 64:
                    names.add(one.lower().rstrip("."))
        return cls(frozenset(names), frozenset(addresses))

    def alternatives(self) -> x509.SubjectAlternativeName:
        """Return the names as a certificate lists them."""
        names = [x509.DNSName(name) for name in sorted(self.names)]
        return x509.SubjectAlternativeName(
            [*names, *(x509.IPAddress(one) for one in sorted(self.addresses, key=str))]
        )


@dataclass(frozen=True)
class Signed:
    """A certificate with its private key."""

    certificate: x509.Certificate
    key: ec.EllipticCurvePrivateKey

    @classmethod
    def read(cls, data: bytes) -> Signed:
        """Return key and certificate out of one PEM.

        Raises:
            ValueError: it is something else, or the two do not belong together.
        """
        key = load_pem_private_key(data, None)
        certificate = x509.load_pem_x509_certificate(data)
        if not isinstance(key, ec.EllipticCurvePrivateKey):
            raise ValueError("the key is of another kind")
        if certificate.public_key() != key.public_key():
            raise ValueError("key and certificate do not belong together")
        return cls(certificate, key)

    @property
    def pem(self) -> bytes:
        """Both, as `read` takes them."""
        key = self.key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption())
        return key + self.certificate.public_bytes(Encoding.PEM)

    @property
    def der(self) -> bytes:
        """The certificate alone, as phones take it."""
        return self.certificate.public_bytes(Encoding.DER)

    def ends_before(self, moment: datetime) -> bool:
        """Return True if it is not valid until a moment."""
        return self.certificate.not_valid_after_utc < moment


def new_authority(machine: str, hosts: Hosts, now: datetime) -> Signed:
    """Return an authority for the addresses of private networks and for what it is asked for."""
    key = ec.generate_private_key(ec.SECP256R1())
    name = _name(f"dva-sim on {machine}"[:64])
    builder = _builder(name, name, key, now, AUTHORITY_DAYS)
    usage = x509.KeyUsage(
        digital_signature=False,
        content_commitment=False,
        key_encipherment=False,
        data_encipherment=False,
        key_agreement=False,
        key_cert_sign=True,
        crl_sign=True,
        encipher_only=False,
        decipher_only=False,
    )
    builder = builder.add_extension(x509.BasicConstraints(True, 0), critical=True)
    builder = builder.add_extension(usage, critical=True)
    builder = builder.add_extension(_constraints(hosts), critical=True)
    builder = builder.add_extension(_identifier(key), critical=False)
    return Signed(builder.sign(key, hashes.SHA256()), key)


def new_leaf(authority: Signed, hosts: Hosts, now: datetime) -> Signed:
    """Return the certificate of this machine."""
    key = ec.generate_private_key(ec.SECP256R1())
    issuer = authority.certificate.subject
    builder = _builder(_name("dva-sim console"), issuer, key, now, LEAF_DAYS)
    usage = x509.KeyUsage(
        digital_signature=True,
        content_commitment=False,
        key_encipherment=False,
        data_encipherment=False,
        key_agreement=False,
        key_cert_sign=False,
        crl_sign=False,
        encipher_only=False,
        decipher_only=False,
    )
    server = x509.ExtendedKeyUsage([ExtendedKeyUsageOID.SERVER_AUTH])
    identifier = x509.AuthorityKeyIdentifier.from_issuer_public_key(authority.key.public_key())
    builder = builder.add_extension(hosts.alternatives(), critical=False)
    builder = builder.add_extension(x509.BasicConstraints(False, None), critical=True)
    builder = builder.add_extension(usage, critical=True)
    builder = builder.add_extension(server, critical=False)
    builder = builder.add_extension(identifier, critical=False)
    builder = builder.add_extension(_identifier(key), critical=False)
    return Signed(builder.sign(authority.key, hashes.SHA256()), key)


def authority_fault(authority: Signed, hosts: Hosts, now: datetime) -> str:
    """Return why an authority can no longer sign for these hosts; empty if it can."""
    if authority.ends_before(now + timedelta(days=LEAF_DAYS)):
        return "it ends soon"
    try:
        constraints = authority.certificate.extensions.get_extension_for_class(x509.NameConstraints)
    except x509.ExtensionNotFound:
        return "it is not bound to this machine"
    allowed = set(constraints.value.permitted_subtrees or ())
    if not allowed >= set(_constraints(hosts).permitted_subtrees or ()):
        return "this machine has other names or public addresses"
    return ""


def leaf_fault(leaf: Signed, authority: Signed, hosts: Hosts, now: datetime) -> str:
    """Return why a leaf can no longer be used; empty if it can."""
    certificate = leaf.certificate
    if leaf.ends_before(now):
        return "it has expired"
    if leaf.ends_before(now + timedelta(days=SPARE_DAYS)):
        return "it ends soon"
    if certificate.not_valid_before_utc > now:
        return "it is not valid yet"
    try:
        certificate.verify_directly_issued_by(authority.certificate)
    except (InvalidSignature, TypeError, ValueError):
        return "another authority has signed it"
    try:
        names = certificate.extensions.get_extension_for_class(x509.SubjectAlternativeName)
    except x509.ExtensionNotFound:
        return "it names no machine"
    missing = set(hosts.alternatives()) - set(names.value)
    return "this machine has other names or addresses" if missing else ""


def _builder(
    subject: x509.Name,
    issuer: x509.Name,
    key: ec.EllipticCurvePrivateKey,
    now: datetime,
    days: int,
) -> x509.CertificateBuilder:
    return (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(issuer)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - BACKDATED)
        .not_valid_after(now + timedelta(days=days))
    )


def _name(common: str) -> x509.Name:
    return x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, common)])


def _identifier(key: ec.EllipticCurvePrivateKey) -> x509.SubjectKeyIdentifier:
    return x509.SubjectKeyIdentifier.from_public_key(key.public_key())


def _constraints(hosts: Hosts) -> x509.NameConstraints:
    """Private networks; and of public addresses and other names those of this machine alone."""
    networks = [ipaddress.ip_network(text) for text in PRIVATE]
    public = [
        ipaddress.ip_network(str(one))
        for one in sorted(hosts.addresses, key=str)
        if not any(one in network for network in networks)
    ]
    names = sorted(name for name in hosts.names if name.rpartition(".")[2] not in LOCAL_NAMES)
    permitted: list[x509.GeneralName] = [x509.DNSName(name) for name in (*LOCAL_NAMES, *names)]
    permitted += [x509.IPAddress(network) for network in (*networks, *public)]
    return x509.NameConstraints(permitted, None)
