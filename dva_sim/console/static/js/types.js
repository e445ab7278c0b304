/**
 * What the page is told, by name. Lengths in metres, angles in radians, times in milliseconds of
 * the world's clock, unless a name says otherwise.
 *
 * @typedef {{i: number, id: string, label: string, kind: string, radius_m: number,
 *   max_speed_mps: number, max_turn_rate_radps: number,
 *   camera?: {field_of_view_deg: number, range_m: number, rate_hz: number},
 *   person?: boolean, wheel_radius_m?: number, corners_m?: number[][], steering?: string,
 *   sensors?: string[]}} Thing
 *
 * @typedef {{name: string, polygon_m: number[][], holes_m: number[][][], floor: string,
 *   outdoor: boolean}} Room
 * @typedef {{cell_m: number, x0_m: number, y0_m: number, columns: number, rows: number,
 *   cells: string, heading_rad?: number}} Raster
 * @typedef {{name: string, extent_m: number[], rooms: Room[], walls_m: number[][],
 *   solids_m: number[][][], doors_m: number[][], exits_m: number[][], raster?: Raster,
 *   origin?: {latitude_deg: number, longitude_deg: number}}} Site
 *
 * @typedef {{processing_s: number, delay_s?: number, jitter_s?: number, loss?: number,
 *   rate_bps?: number | null, jitter_wanted_s?: number, kind?: string, trace?: string | null,
 *   rate_trace?: string | null}} LinkSetting
 * @typedef {{robots: number[], goals_m: number[][], radius_m: number, length_m: number,
 *   side_rad: number}} TourPlan
 * @typedef {{x: number, y: number, radius: number, name: string}} Goal
 * @typedef {{scenario: string, title: string, site: Site, things: Thing[],
 *   patterns: {name: string, title: string}[], link: LinkSetting,
 *   link_limits: Record<string, number[]>, watchdog_s: number, stale_s: number,
 *   pages?: string[], lag_limit_s: number, dva_address?: string, attached?: boolean, phone?: PhoneOffer,
 *   replay?: ReplayAbout | null}} Scene
 * @typedef {{t: number, who: string, what: string, kind: string}} Mark
 * @typedef {{name: string, duration_ms: number, whole: boolean, marks: Mark[],
 *   audit: boolean}} ReplayAbout
 * @typedef {{name: string, bytes: number, part: string, person: number | null,
 *   trial: number | null, levels: unknown[], values: unknown[]}} ShelfEntry
 * @typedef {{folder: string, question: string, report: boolean, factors: string[],
 *   measures: {title: string, unit: string}[], worst_by: string,
 *   recordings: ShelfEntry[]}} Shelf
 * @typedef {{pipelines: Record<string, any>, filters: string[], mappings: string[],
 *   speed_step_mps2: number, turn_step_mps2: number, max_delay_s: number}} PhoneOffer
 *
 * @typedef {{factor: number, paused: boolean, lag_s: number, held_by_lag: boolean,
 *   jumps?: number}} Clock
 * @typedef {{i: number, mode: string, pattern: string, battery: number | null,
 *   holder: string | null, holder_label?: string | null, session_age_s?: number | null,
 *   watchdog_left_s: number | null, stands: string, set_speed_mps: number,
 *   set_turn_rate_radps: number, queue: number, lost: number, commands_hz: number,
 *   refused: number, by_hand?: boolean, camera?: string | null, sensors?: string[]}} RobotRow
 * @typedef {{last_ms: number, median_ms: number, p95_ms: number, largest_ms: number,
 *   count: number}} LatencyFigures
 * @typedef {{name: string, unit: string, stuck: boolean, values?: number[],
 *   least?: number}} SensorShown
 * @typedef {{state: string, address: string, dva: string | null, problem: string,
 *   by_hand?: boolean, asking?: boolean}} StationShown
 * @typedef {{i: number, t: number, station: StationShown, mode: string, hand: number | null,
 *   holder: string | null, stands: string, notice: string, link_lost: boolean,
 *   emergency: {at_ms: number, by: string} | null, speed_mps: number, turn_rate_radps: number,
 *   now_mps: number, now_radps: number, watchdog_left_s: number | null,
 *   one_way: LatencyFigures | null, loop: LatencyFigures | null, replies: LatencyFigures | null,
 *   faults: {processing_s: number | null, replies: boolean, freeze: boolean, camera: boolean},
 *   sensors: SensorShown[]}} RobotWindow
 * @typedef {{t: number, clock: Clock, link: LinkSetting, dropped: number, robots: RobotRow[],
 *   people: {i: number, doing: string}[], order?: Order | null, server?: Server}} Rows
 * @typedef {{listens: boolean, address: string, port: number | null, modelled: boolean,
 *   own?: boolean, role?: string}} Server
 *
 * @typedef {{n: number, kind: string, x_m: number, y_m: number, radius_m: number,
 *   severity: number, contained: boolean}} Hazard
 * @typedef {Raster & {kind: string, full?: {value: number, unit: string} | string}} Field
 * @typedef {{hazards: Hazard[], fields: Field[]}} Hazards
 *
 * @typedef {{number: number, kind: string, x_m: number, y_m: number, room: string,
 *   severity: string, state: string, since_ms: number, reported_ms: number,
 *   assigned: string[], over?: boolean, decisions?: number, note?: string | null,
 *   acknowledged?: {label: string, at_ms: number} | null,
 *   decided?: {label: string, action: string, at_ms: number, reason: string} | null}} SiteEvent
 *
 * @typedef {{label: string, role: string, client: string}} ControlRoom
 * @typedef {{dispatch: {mode: string, decide_within_s: number,
 *   switched: {label: string, at_ms: number} | null} | null, rooms: ControlRoom[]}} Control
 * @typedef {{label: string, robot: boolean, can: boolean, free: boolean, reason: string,
 *   arrival_s: number | null}} Candidate
 * @typedef {{event: number, policy: string, reason: string, task: string | null, label: string,
 *   arrival_s: number | null, decide_within_s: number | null, candidates: Candidate[]}} Proposal
 * @typedef {{key: string, priority: string, state: string, text: string, place: string,
 *   count: number, event: number | null, since_ms: number, is_new: boolean, seen_by: string,
 *   left_s: number | null, shelved_by: string}} AlarmRow
 * @typedef {{alarms: AlarmRow[], shelved: AlarmRow[], flood: boolean, rate: number}} AlarmList
 * @typedef {{rows: number, hash: string, problem: string, lasting: boolean, file: string}} AuditState
 * @typedef {{number: number, time_s: number, at_utc: string, author: string, device: string,
 *   role: string, action: string, event: number | null, subject: string, cause: string,
 *   outcome: string, text: string, details: Record<string, any>, hash: string}} AuditRow
 * @typedef {{rows: number, hash: string, problem: {row: number, text: string} | null,
 *   doubts: string[]}} AuditCheck
 * @typedef {{events: number, median_s: number | null, largest_s: number | null}} Times
 * @typedef {{acknowledge: Times, assign: Times, assigned_by_people: number,
 *   assigned_by_policy: number, overrides: number, lost_s: number | null,
 *   newest_overrides: {number: number, event: number, author: string, did: string,
 *   did_s: number | null, advised: string | null, advised_s: number | null,
 *   cause: string}[]}} AuditMeasures
 *
 * @typedef {{i: number, pattern: string, phase: string, mode: string, session?: number,
 *   wanted: number[], command: number[], sent: number, answered: number, timeouts: number,
 *   refused: number, superseded: number, command_age_ms: number | null,
 *   round_trip_ms: number | null, picture_ms: number | null, loop_ms: number | null}} SeatDrive
 * @typedef {{event: number, kind: string, robot: number, x_m: number, y_m: number,
 *   room?: string}} Order
 * @typedef {{t: number, seat: string, phase: string, order: Order | null, alert: string,
 *   drives: SeatDrive[], phone?: Phone | null}} Seat
 * @typedef {{id: string, label: string, address: string, registered: boolean,
 *   device: string | null, level: string | null, calibrated: boolean, pipeline: string,
 *   filter: string | null, mapping: string, radius_deg: number, speed_mps: number,
 *   reading: number[] | null, sensor_hz: number | null, samples: number, samples_lost: number,
 *   attempts: number}} Phone
 * @typedef {{id: string, label: string, type: string, address: string}} Device
 *
 * @typedef {{event: number, kind: string, task: string, x_m: number, y_m: number,
 *   room?: string, distance_m: number | null, way_m: number[][], answered: boolean}} GuardOrder
 * @typedef {{t: number, seat: string, guard: number, label: string, doing: string,
 *   order: GuardOrder | null, alert: string}} Guard
 *
 * @typedef {{client: string, key: string, role: string}} You
 * @typedef {{id?: string, late?: boolean, ok: boolean, text: string, tour?: TourPlan, phone?: {id: string, label: string,
 *   address: string}, devices?: Device[], proposal?: Proposal, event?: number, hand?: number}} Done
 * @typedef {{kind: 'thing' | 'event', key: number} | null} Selection
 */
export {};
