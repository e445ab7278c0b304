"""One strategy per body: everything the protocol can say, at its bounds too."""

from hypothesis import strategies as st

from dva_sim.protocol import messages as m

UINT32 = 2**32 - 1
UINT64 = 2**64 - 1
ROBOT, TABLET = "70:1A:04:F9:81:D6", "56:2B:04:E4:56:D8"


def real(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(low, high).map(lambda value: value + 0.0)  # -0.0 is written as 0.0


def characters(least: int, most: int) -> st.SearchStrategy[str]:
    # The two non-characters are not allowed in XML at all.
    allowed = st.characters(exclude_categories=["Cc", "Cs"], exclude_characters="\ufffe\uffff")
    return st.text(allowed, min_size=least, max_size=most)


ids = st.from_regex(r"\A[0-9A-F]{2}(:[0-9A-F]{2}){5}\Z")
clocks = st.from_regex(r"\A([01][0-9]|2[0-3])(:[0-5][0-9]){2}(\.[0-9]{1,9})?\Z")
addresses = st.ip_addresses(v=4).map(str) | st.ip_addresses(v=4).map("{}:5556".format)
urls = st.text(st.characters(min_codepoint=0x21, max_codepoint=0x7E), min_size=1, max_size=256)
names = characters(1, 64)
numbers = st.integers(1, UINT32)
counts = st.integers(0, UINT32)
ticks = st.integers(0, 2**53 - 1)
positions = st.builds(m.Position, real(-90, 90), real(-180, 180))
speeds = turn_rates = real(-100, 100)
shares = real(0, 1)
kinds = st.sampled_from(["fire", "gas_leak", "flood"])
tasks = st.sampled_from(["confirm", "contain", "stand_by"])
levels = st.sampled_from(["teleoperation", "missions", "both", "sensors"])

sessions = st.integers(1, UINT64)
sensor_names = st.lists(names, max_size=4).map(tuple)
sensors = st.builds(m.Sensor, names, names)
granted = levels, sessions, st.none() | addresses, sensor_names

measured = st.lists(real(-1e8, 1e8), min_size=1, max_size=40).map(tuple)
mission_states = st.sampled_from(["none", "under_way", "waiting", "replanning", "done", "failed"])
mission_statuses = st.builds(
    m.MissionStatus,
    st.integers(0, UINT32),
    mission_states,
    st.integers(0, 64),
    characters(0, 256),
)
devices = st.builds(m.Device, ids, names, names, addresses)
held = real(0, 1e6)
spans, texts, maybe_text = real(0, 1e6), characters(0, 256), st.none() | characters(0, 256)
maybe_tasks, maybe_count, maybe_ids = st.none() | tasks, st.none() | counts, st.none() | ids
modes_of_dispatch = st.sampled_from(["automatic", "ask_first"])
roles = st.none() | st.sampled_from(["look", "drive", "dispatch", "supervise"])
by_whom = st.none() | st.builds(m.ByWhom, ids, names, spans)
event_statuses = st.builds(
    m.EventStatus,
    numbers,
    kinds,
    positions,
    shares,
    shares,
    st.sampled_from(
        [
            "pending",
            "assigned",
            "on_scene",
            "confirmed",
            "contained",
            "refuted",
            "escalated",
            "expired",
        ]
    ),
    spans,
    spans,
    counts,
    st.none() | spans,
    maybe_tasks,
    maybe_ids,
    maybe_ids,
    maybe_ids,
    by_whom,
    st.none() | st.builds(m.LastDecision, ids, names, names, spans, maybe_text),
    st.none() | st.builds(m.Proposed, ids, tasks, spans, spans),
    maybe_text,
)
dispatch_statuses = st.builds(m.DispatchStatus, modes_of_dispatch, spans, by_whom, roles)
candidates = st.builds(m.Candidate, ids, names, texts, st.none() | spans)
contents = st.one_of(
    st.none(),
    st.builds(m.EventList, st.lists(event_statuses, max_size=2).map(tuple)),
    event_statuses,
    st.builds(
        m.Proposal,
        numbers,
        names,
        texts,
        maybe_tasks,
        maybe_ids,
        st.none() | spans,
        st.none() | spans,
        st.lists(candidates, max_size=3).map(tuple),
    ),
    dispatch_statuses,
    st.builds(m.DeviceList, st.lists(devices, max_size=6).map(tuple)),
    st.builds(m.SensorInfo, urls, st.lists(sensors, max_size=4).map(tuple)),
    st.builds(m.Permission, ids, *granted),
    mission_statuses,
    st.builds(m.Holder, ids, names, held),
    st.builds(m.SessionFloor, sessions),
    st.builds(
        m.SensorList,
        st.lists(
            st.builds(
                m.DeviceSensors, ids, st.none() | urls, st.lists(sensors, max_size=3).map(tuple)
            ),
            max_size=3,
        ).map(tuple),
    ),
)
BODIES: dict[type, st.SearchStrategy[m.Body]] = {
    m.Emergency: st.builds(m.Emergency),
    m.Heartbeat: st.builds(m.Heartbeat),
    m.Registration: st.builds(m.Registration, names, names, addresses),
    m.StartTeleOp: st.builds(m.StartTeleOp),
    m.SetTeleOp: st.builds(m.SetTeleOp, speeds, turn_rates, st.none() | ticks),
    m.StopTeleOp: st.builds(m.StopTeleOp),
    m.RobotStatus: st.builds(
        m.RobotStatus,
        st.sampled_from(["Idle", "Mission", "Teleoperation"]),
        positions,
        real(-1e6, 1e6),
        speeds,
        turn_rates,
        ticks,
    ),
    m.RobotHolder: st.builds(
        m.RobotHolder, st.none() | ids, st.none() | names, held, st.none() | st.integers(0, 999)
    ),
    m.PersonStatus: st.builds(m.PersonStatus, names, positions),
    m.GoTo: st.builds(m.GoTo, st.lists(positions, min_size=1, max_size=40).map(tuple)),
    m.Patrol: st.builds(
        m.Patrol, st.lists(positions, min_size=1, max_size=40).map(tuple), st.integers(0, 1000)
    ),
    m.Inspect: st.builds(m.Inspect, numbers, kinds, positions),
    m.ReturnToBase: st.builds(m.ReturnToBase),
    m.CancelMission: st.builds(m.CancelMission),
    m.GetMissionStatus: st.builds(m.GetMissionStatus),
    m.MissionStatus: mission_statuses,
    m.GetSensorInfo: st.builds(m.GetSensorInfo, st.none() | ids),
    m.SensorValue: st.builds(m.SensorValue, names, measured, names, ticks),
    m.GetDeviceList: st.builds(m.GetDeviceList),
    m.DevSub: st.builds(m.DevSub, names, real(0, 1000)),
    m.PermissionRequest: st.builds(
        m.PermissionRequest,
        ids,
        levels,
        sensor_names,
        st.none() | st.sampled_from(["no", "ask", "force"]),
    ),
    m.HandoverRequest: st.builds(m.HandoverRequest, ids, ids, names),
    m.GetGrant: st.builds(m.GetGrant, st.none() | ids, st.none() | levels),
    m.PermissionGrant: st.builds(m.PermissionGrant, ids, *granted),
    m.PermissionRevocation: st.builds(m.PermissionRevocation, ids, ids, sessions),
    m.EventReport: st.builds(
        m.EventReport,
        st.none() | numbers,
        kinds,
        positions,
        shares,
        shares,
        st.sampled_from(["detected", "confirmed", "refuted", "contained"]),
    ),
    m.Order: st.builds(m.Order, numbers, kinds, positions, st.none() | ids, tasks),
    m.OrderProgress: st.builds(
        m.OrderProgress,
        numbers,
        st.sampled_from(["accepted", "declined", "departed", "arrived", "failed", "done"]),
    ),
    m.TaskAnnouncement: st.builds(
        m.TaskAnnouncement, numbers, kinds, positions, shares, real(0, 1e6)
    ),
    m.TaskBid: st.builds(m.TaskBid, numbers, real(0, 1e6)),
    m.TaskAward: st.builds(m.TaskAward, numbers),
    m.Relocation: st.builds(m.Relocation, positions),
    m.GetEventList: st.builds(m.GetEventList, st.none() | numbers),
    m.GetDispatch: st.builds(m.GetDispatch),
    m.SetDispatch: st.builds(m.SetDispatch, modes_of_dispatch, maybe_text),
    m.Acknowledge: st.builds(m.Acknowledge, numbers),
    m.Assign: st.builds(m.Assign, numbers, ids, maybe_ids, maybe_tasks, maybe_text, maybe_count),
    m.TakeOff: st.builds(m.TakeOff, numbers, ids, maybe_text, maybe_count),
    m.FalseAlarm: st.builds(m.FalseAlarm, numbers, texts, maybe_count),
    m.Escalate: st.builds(m.Escalate, numbers, maybe_text, maybe_count),
    m.AddNote: st.builds(m.AddNote, numbers, texts),
    m.GetProposal: st.builds(m.GetProposal, numbers),
    m.Revoke: st.builds(m.Revoke, ids, maybe_text),
    m.EventStatus: event_statuses,
    m.DispatchStatus: dispatch_statuses,
    m.AuditRecord: st.builds(
        m.AuditRecord,
        ids,
        names,
        names,
        texts,
        st.integers(0, 999),
        texts,
        roles,
        st.none() | numbers,
        maybe_ids,
        maybe_tasks,
        st.none() | spans,
        maybe_ids,
        st.none() | spans,
    ),
    m.Reply: st.builds(
        m.Reply, st.integers(0, UINT32), st.integers(0, 999), characters(0, 256), contents
    ),
}


def with_header(body: m.Body) -> st.SearchStrategy[m.Message]:
    session = st.none() if isinstance(body, m.Heartbeat) else st.integers(0, UINT64)
    return st.builds(m.Message, ids, numbers, ids, clocks, session, st.just(body))


messages = st.one_of(*BODIES.values()).flatmap(with_header)


def message(body: m.Body, session: int | None = 1425) -> m.Message:
    """A message with the header of the one printed in the specification."""
    return m.Message(ROBOT, 124, TABLET, "12:30:56", session, body)
