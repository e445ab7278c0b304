// Written by dva_sim/console/wire/generated.py.
/**
 * Geographic origin of a site.
 * @typedef {{latitude_deg: number, longitude_deg: number}} Origin
 */
/**
 * A room of a site.
 * @typedef {{name: string, polygon_m: number[][], holes_m: number[][][], floor: string,
 *   outdoor: boolean, place_m: number[] | null}} Room
 */
/**
 * A region of a site: its borders within that, and its corner in the north-west.
 * @typedef {{name: string, borders_m: number[][][], place_m: number[]}} RegionPlan
 */
/**
 * A grid whose row 0 lies to the south; its cells as base64.
 * @typedef {{cell_m: number, x0_m: number, y0_m: number, columns: number, rows: number,
 *   cells: string, heading_rad?: number}} Raster
 */
/**
 * The plan of a site.
 * @typedef {{name: string, extent_m: number[], origin: Origin, features: Record<string, any>,
 *   rooms: Room[], walls_m: number[][], solids_m: number[][][], doors_m: number[][],
 *   exits_m: number[][], regions: RegionPlan[], raster?: Raster}} Site
 */
/**
 * A robot's camera.
 * @typedef {{field_of_view_deg: number, range_m: number, rate_hz: number, frame_bytes: number}}
 *   Camera
 */
/**
 * Somebody, with the number that other lines use.
 * @typedef {{radius_m?: number, max_speed_mps?: number, max_turn_rate_radps?: number,
 *   camera?: Camera, person?: boolean, wheel_radius_m?: number, corners_m?: number[][],
 *   steering?: string, sensors?: string[], i: number, id: string, label: string, kind: string}}
 *   Thing
 */
/**
 * A messaging pattern that may be chosen.
 * @typedef {{name: string, title: string, label: string, when_slow: string, answered: boolean}}
 *   Pattern
 */
/**
 * A colour or mark of a map.
 * @typedef {{kind: string, colour: string, mode?: string, title?: string, mark?: string,
 *   field?: boolean}} LegendEntry
 */
/**
 * Settings of the link; more of a modelled one.
 * @typedef {{kind: 'modelled' | 'real' | 'attached', processing_s: number | null,
 *   delay_s?: number, jitter_s?: number, jitter_wanted_s?: number, loss?: number,
 *   rate_bps?: number | null, trace?: string | null, rate_trace?: string | null}} Link
 */
/**
 * Between which numbers a calibration lies.
 * @typedef {{step_mps2: number[], max_delay_s: number[]}} PhoneLimits
 */
/**
 * Choices of a phone.
 * @typedef {{pipelines: Record<string, Record<string, any>>, pipeline: string, filters: string[],
 *   mappings: string[], speed_step_mps2: number, turn_step_mps2: number, max_delay_s: number,
 *   limits: PhoneLimits}} PhoneOffer
 */
/**
 * Something that happened.
 * @typedef {{t: number, who: string, what: string, kind: string}} Happened
 */
/**
 * A recording that is played.
 * @typedef {{name: string, duration_ms: number, whole: boolean, marks: Happened[],
 *   audit: boolean}} ReplayAbout
 */
/**
 * Scene, which does not change while something is shown; `begins_at` is the first page.
 * @typedef {{scenario: string, title: string, seed: number | null, site: Site, things: Thing[],
 *   patterns: Pattern[], link_limits: Record<string, number[]>, pace_limits: number[],
 *   watchdog_s: number | null, stale_s: number | null, lag_limit_s: number, rules: Record<string,
 *   string>, legend: LegendEntry[], link: Link, attached?: boolean, dva_address?: string,
 *   begins_at?: string, pages?: string[], phone?: PhoneOffer, replay?: ReplayAbout}} Scene
 */
/**
 * Something has happened.
 * @typedef {{t: number, who: string, what: string, kind: string, k: 'story'}} Story
 */
/**
 * An order for an operator.
 * @typedef {{event: number, kind: string, robot: number | null, x_m: number, y_m: number,
 *   room: string | null}} Order
 */
/**
 * Public part of a seat.
 * @typedef {{k: 'seat', short: boolean, seat: string, label: string, phase: string, order: Order |
 *   null, robots: (number | null)[]}} OtherSeat
 */
/**
 * State of the clock.
 * @typedef {{factor: number, paused: boolean, lag_s: number, given_up_s: number,
 *   held_by_lag: boolean, jumps?: number}} Clock
 */
/**
 * Emergency that holds a robot; `released_by`: `person`, `drive`, or empty where unknown.
 * @typedef {{at_ms: number, by: string, released_by: string}} Emergency
 */
/**
 * State of a robot; `silent`: the DVA has lost it, and lists it no longer.
 * @typedef {{i: number, mode: string, stop_reason: string, pattern: string | null, battery: number
 *   | null, holder: string | null, holder_label: string | null, session_age_s: number | null,
 *   watchdog_left_s: number | null, set_speed_mps: number | null, set_turn_rate_radps: number |
 *   null, queue: number | null, lost: number | null, commands_hz: number | null, refused: number |
 *   null, timeouts: number | null, emergency: Emergency | null, by_hand?: boolean, camera?: string
 *   | null, sensors?: string[], silent?: boolean}} RobotRow
 */
/**
 * Activity of somebody on foot.
 * @typedef {{i: number, doing: string}} Doing
 */
/**
 * Address of the DVA, and whether it listens.
 * @typedef {{listens: boolean, address: string, port: number | null, modelled: boolean,
 *   own?: boolean, role?: string, console?: string, hearing?: 'answers' | 'silent' | 'never',
 *   log?: 'unknown' | 'kept' | 'not_kept' | 'not_permitted'}} Server
 */
/**
 * A region, in words who serves it, and whether its own DVA may have it back.
 * @typedef {{name: string, state: 'served' | 'deputy' | 'dead', text: string,
 *   is_returnable: boolean}} Region
 */
/**
 * States of clock, link, robots and people, and of regions if there are several DVAs.
 * @typedef {{k: 'rows', t: number, clock: Clock, link: Link | null, dropped: number,
 *   robots: RobotRow[], people: Doing[], order: Order | null, server?: Server,
 *   regions?: Region[]}} Rows
 */
/**
 * A hazard on the map.
 * @typedef {{n: number, kind: string, x_m: number, y_m: number, radius_m: number,
 *   severity: number, contained: boolean}} Hazard
 */
/**
 * The quantity that a full cell stands for.
 * @typedef {{value: number, unit: string}} FieldScale
 */
/**
 * Effect of hazards on the air or the floor.
 * @typedef {{cell_m: number, x0_m: number, y0_m: number, columns: number, rows: number,
 *   cells: string, heading_rad?: number, kind: string, full: FieldScale}} Field
 */
/**
 * Positions and extents of hazards.
 * @typedef {{k: 'hazards', t: number, hazards: Hazard[], fields: Field[]}} Hazards
 */
/**
 * Somebody, and when.
 * @typedef {{label: string, at_ms: number}} LabelledMoment
 */
/**
 * The newest decision on an event.
 * @typedef {{label: string, at_ms: number, action: string, reason: string}} Decided
 */
/**
 * State of an event, and what was decided on it.
 * @typedef {{decisions: number, acknowledged: LabelledMoment | null, decided: Decided | null,
 *   note: string | null, number: number, kind: string, x_m: number, y_m: number,
 *   latitude_deg: number, longitude_deg: number, room: string | null, severity: string,
 *   severity_value: number, state: string, over: boolean, since_ms: number, reported_ms: number,
 *   assigned: string[]}} SiteEvent
 */
/**
 * All events that are open, and the last that are over.
 * @typedef {{k: 'events', t: number, events: SiteEvent[]}} Events
 */
/**
 * Dispatch mode.
 * @typedef {{mode: string, decide_within_s: number, switched: LabelledMoment | null}} Dispatch
 */
/**
 * A control room.
 * @typedef {{label: string, role: string, client: string}} RoomEntry
 */
/**
 * Work that somebody offers to a colleague.
 * @typedef {{number: number, sender: string, to: string, client: string, events: number[],
 *   robots: string[], note: string, whole: boolean, at_ms: number, accepted: boolean | null}}
 *   Offer
 */
/**
 * Person who answers for an event that was handed over.
 * @typedef {{event: number, label: string}} Owner
 */
/**
 * Dispatch mode, who decides, and what they hand over to each other.
 * @typedef {{k: 'control', t: number, dispatch: Dispatch | null, rooms: RoomEntry[],
 *   offers?: Offer[], owners?: Owner[]}} Control
 */
/**
 * A row of the list of alarms.
 * @typedef {{key: string, priority: string, state: string, text: string, place: string,
 *   count: number, event: number | null, since_ms: number, is_new: boolean, seen_by: string,
 *   left_s: number | null, shelved_by: string, shelved_why: string}} AlarmRow
 */
/**
 * The alarms, and how many there were lately.
 * @typedef {{k: 'alarms', t: number, alarms: AlarmRow[], shelved: AlarmRow[], flood: boolean,
 *   rate: number, left_out: number}} Alarms
 */
/**
 * State of the audit log.
 * @typedef {{k: 'audit', t: number, rows: number, hash: string, problem: string, lasting: boolean,
 *   file: string}} Audit
 */
/**
 * Availability of pictures, and why there are none.
 * @typedef {{k: 'pictures', ok: boolean, text: string, t?: number}} Pictures
 */
/**
 * All that has happened up to a moment of a recording.
 * @typedef {{k: 'story_so_far', t: number, lines: Happened[]}} StorySoFar
 */
/**
 * A column of the list of recordings.
 * @typedef {{title: string, unit: string}} Measure
 */
/**
 * A recording that can be played.
 * @typedef {{name: string, bytes: number, part: string, person: number | null, trial: number |
 *   null, levels: any[], values: any[]}} ShelfEntry
 */
/**
 * The recordings that can be played.
 * @typedef {{k: 'shelf', folder: string, question: string, report: boolean, factors: string[],
 *   measures: Measure[], worst_by: string, recordings: ShelfEntry[]}} Shelf
 */
/**
 * The newest of everything.
 * @typedef {{pos?: number[][], story?: Story[], story_from?: number, seats?: OtherSeat[],
 *   rows?: Rows, hazards?: Hazards, events?: Events, control?: Control, alarms?: Alarms,
 *   audit?: Audit, pictures?: Pictures, story_so_far?: StorySoFar, shelf?: Shelf}} SnapState
 */
/**
 * All there is, for a page that begins.
 * @typedef {{k: 'snap', t: number, scene: Scene | null, state: SnapState}} Snap
 */
/**
 * Agents that have moved, and that have left the site.
 * @typedef {{k: 'd', t: number, p: number[][], gone?: number[]}} Moved
 */
/**
 * Station of a robot: off, registered, listening.
 * @typedef {{state: string, address: string | null, dva: string | null, problem: string,
 *   asking?: boolean, by_hand?: boolean}} Station
 */
/**
 * Latency of a kind of messages.
 * @typedef {{last_ms: number, median_ms: number, p95_ms: number, largest_ms: number,
 *   count: number}} LatencyFigures
 */
/**
 * Faults of a robot.
 * @typedef {{processing_s: number | null, replies: boolean, freeze: boolean, camera: boolean}}
 *   Faults
 */
/**
 * A sensor, with its values or the least of many; neither: it has none.
 * @typedef {{name: string, unit: string, stuck: boolean, values?: number[], least?: number}}
 *   Sensor
 */
/**
 * Contents of a robot's windows.
 * @typedef {{k: 'robot', t: number, i: number, station: Station, mode: string, hand: number |
 *   null, holder: string | null, stop_reason: string, link_lost: boolean, notice: string,
 *   speed_mps: number | null, turn_rate_radps: number | null, now_mps: number, now_radps: number,
 *   watchdog_left_s: number | null, one_way: LatencyFigures | null, loop: LatencyFigures | null,
 *   replies: LatencyFigures | null, faults: Faults, sensors: Sensor[]}} RobotWindow
 */
/**
 * A device, as the DVA knows it that `dva` names.
 * @typedef {{id: string, label: string, type: string, address: string, dva: string | null,
 *   doing: string | null, heard_s: number | null, silent: boolean, beats_hz: number, link: string
 *   | null, fake: boolean, round_trip_s: number | null, commands_hz: number | null,
 *   refused: number | null, picture_age_s: number | null, holder: string | null,
 *   holder_label: string | null, level: string | null, ends_s: number | null,
 *   holder_known?: boolean, revocable?: boolean, camera?: string | null, sensors?: string[]}}
 *   DeviceRow
 */
/**
 * All devices.
 * @typedef {{k: 'devices', t: number, devices: DeviceRow[]}} Devices
 */
/**
 * State of the newest mission of a robot in somebody's hands.
 * @typedef {{state: string, places_left: number, reason: string}} Mission
 */
/**
 * A sensor of a robot in hand, with its values or the least of many while it is read.
 * @typedef {{name: string, unit: string, rate_hz: number | null, age_s: number | null,
 *   alarm_at: number | null, values?: number[], least?: number}} Sensed
 */
/**
 * The input behind the newest command that took effect.
 * @typedef {{n: number, at_ms: number}} InputHeard
 */
/**
 * A robot in somebody's hands.
 * @typedef {{i: number | null, level: string, mission: Mission | null, sensors: Sensed[],
 *   pattern: string, phase: string, mode: string, session: number | null, wanted: number[],
 *   command: number[], command_age_ms: number | null, picture_ms: number | null,
 *   picture_arrived_ms: number | null, silent_s: number | null, loop_ms: number | null,
 *   input: InputHeard | null, sent: number, answered: number, timeouts: number, refused: number,
 *   superseded: number, round_trip_ms: number | null, outcome: string | null}} Drive
 */
/**
 * A phone in somebody's hand.
 * @typedef {{id: string, label: string, address: string, registered: boolean, device: string |
 *   null, level: string | null, calibrated: boolean, pipeline: string, filter: string | null,
 *   mapping: string, radius_deg: number, speed_mps: number, reading: number[] | null,
 *   sensor_hz: number | null, samples: number, samples_lost: number, attempts: number}} Phone
 */
/**
 * State of a seat's own drives.
 * @typedef {{k: 'seat', t: number, seat: string, label: string, phase: string, order: Order |
 *   null, alert: string, drives: Drive[], phone: Phone | null}} Seat
 */
/**
 * An order for a guard.
 * @typedef {{x_m: number, y_m: number, room: string | null, distance_m: number | null,
 *   way_m: number[][], event: number, kind: string, task: string, answered: boolean}} GuardOrder
 */
/**
 * State of the guard that a page's person plays.
 * @typedef {{k: 'guard', t: number, seat: string, guard: number | null, label: string,
 *   doing: string, order: GuardOrder | null, alert: string}} Guard
 */
/**
 * @typedef {{n: number, t: number, kind: string, payload: string, from: string,
 *   from_label: string, to: string, to_label: string, session: string, code: number | null,
 *   word: string, text: string, service_us: number | null, published: boolean}} LogEntry
 */
/**
 * News of a log that a page looks at; `first`: replaces what was shown before.
 * @typedef {{k: 'log', log: string, total: number, first: boolean, missed: number,
 *   lines: LogEntry[]}} Log
 */
/**
 * Step in the history of an event.
 * @typedef {{event: number, at_ms: number, what: string, who: string, device: string,
 *   reason: string}} Step
 */
/**
 * Line of the instructions for an event; `step` is its number among the boxes to tick.
 * @typedef {{text: string, step: number | null, done: LabelledMoment | null}} Instruction
 */
/**
 * History of one event or of all, and the instructions of one.
 * @typedef {{event: number | null, history: Step[], instructions: Instruction[]}} Details
 */
/**
 * A device on the DVA's list.
 * @typedef {{id: string, label: string, type: string, address: string}} Device
 */
/**
 * A phone on the network of devices.
 * @typedef {{id: string, label: string, address: string}} PhoneIdentity
 */
/**
 * Somebody who could be sent to an event.
 * @typedef {{label: string, robot: boolean, can: boolean, free: boolean, reason: string,
 *   arrival_s: number | null}} Candidate
 */
/**
 * Proposal of the policy about an event, with its reasons.
 * @typedef {{event: number, policy: string, reason: string, task: string | null, label: string,
 *   arrival_s: number | null, decide_within_s: number | null, candidates: Candidate[]}} Proposal
 */
/**
 * Two robots, and a goal for each.
 * @typedef {{robots: number[], goals_m: number[][], radius_m: number, length_m: number,
 *   side_rad: number}} TourPlan
 */
/**
 * Outcome of an action.
 * @typedef {{t?: number, late?: boolean, details?: Details, device?: string, devices?: Device[],
 *   event?: number, hand?: number | null, outcome?: string, phone?: PhoneIdentity,
 *   proposal?: Proposal, tour?: TourPlan, k: 'done', id: string | null, ok: boolean,
 *   text: string}} Done
 */
/**
 * It is over.
 * @typedef {{k: 'bye', why: string, t?: number}} Bye
 */
/**
 * Identity of a page; `user`: who is logged in there, or empty.
 * @typedef {{k: 'you', client: string, key: string, role: string, user: string}} You
 */
/**
 * An answer to a ping, with the time of this machine [ms].
 * @typedef {{k: 'pong', at: any, now: number}} Pong
 */
/**
 * An entry with its row number and hash.
 * @typedef {{time_s: number, at_utc: string, author: string, device: string, role: string,
 *   action: string, event: number | null, subject: string, cause: string, outcome: string,
 *   text: string, details: Record<string, any>, number: number, before: string, hash: string}}
 *   AuditRow
 */
/**
 * The first row that does not hold, and what is wrong with it.
 * @typedef {{row: number, text: string}} WrongRow
 */
/**
 * Result of a check of the whole chain.
 * @typedef {{rows: number, hash: string, problem: WrongRow | null, doubts: string[]}} AuditCheck
 */
/**
 * Duration of something, the first time for each event.
 * @typedef {{events: number, median_s: number | null, largest_s: number | null}} TimesTaken
 */
/**
 * Somebody else was sent than the policy would have sent.
 * @typedef {{number: number, event: number | null, author: string, did: string, did_s: number |
 *   null, advised: string | null, advised_s: number | null, cause: string}} Override
 */
/**
 * Times to acknowledge and to assign, and what people did otherwise than the policy.
 * @typedef {{acknowledge: TimesTaken, assign: TimesTaken, assigned_by_people: number,
 *   assigned_by_policy: number, overrides: number, lost_s: number | null,
 *   newest_overrides: Override[]}} AuditMeasures
 */
/**
 * A line sent to a page.
 * @typedef {(Snap | Moved | Rows | RobotWindow | Devices | Hazards | Events | Control | Alarms |
 *   Audit | Story | StorySoFar | Seat | OtherSeat | Guard | Log | Shelf | Pictures | Done | Bye |
 *   You | Pong) & {s?: number}} ToPage
 */
export {};
