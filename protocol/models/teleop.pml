/* A drive, and everything that may happen to it: two operators, a robot, the DVA that gives the
 * robot to one or the other, a forger, and a network that loses, doubles and reorders.
 *
 *   spin -a teleop.pml && cc -O2 -DNOREDUCE -DSAFETY -o pan pan.c && ./pan -m400000
 *   spin -a -DLIVE=1 -DSESSIONS=1 -DLETTERS=1 teleop.pml
 *   cc -O2 -DNOREDUCE -DNFAIR=4 -o pan pan.c && ./pan -a -f -m400000 -N drive_ends
 *
 * The robot obeys teleop_table.pml, which is taken from the program. Bounds: -DSESSIONS=3,
 * -DLETTERS=3. A mechanism is left out by -DNO_...; then a rule of docs/explanation/safety-rules.md must break.
 * Time passes in ticks of a second or so; only the order of the limits is that of the program.
 */
#ifndef SESSIONS
#define SESSIONS 2              /* that the DVA gives: 1, 2, ... */
#endif
#ifndef LETTERS
#define LETTERS 2               /* of operators, under way or waiting at the robot */
#endif
#define WATCHDOG 1              /* a command is in force so long after its arrival, ... */
#define MAX_AGE 2               /* ... and so long after its picture; */
#define LEASE 2                 /* a drive lasts so long without anything valid */
#define NOBODY 2

mtype = { START, SET, STOP, EMERGENCY, GRANT, REVOKE, ANSWER };
mtype = { FREE, HELD, DRIVES, OTHER_HELD, OTHER_DRIVES };

/* --- the robot ------------------------------------------------------------------------------ */
byte holder = NOBODY;           /* as the DVA has confirmed */
byte session;                   /* the holder's */
bool driven;                    /* by the holder, or idle */
bool commanded;                 /* the set point in force is not zero */
byte remains;                   /* until that lapses */
bool moving;                    /* the wheels turn */
byte silence;                   /* since anything valid came from the driver */
bool wants;                     /* the question who holds it is open, */
bool asked;                     /* or under way; */
bool answered;                  /* the DVA has answered, as follows */
byte told_holder = NOBODY;
byte told_session;
byte over;                      /* sessions that were said to be over since it was asked */

/* --- the DVA -------------------------------------------------------------------------------- */
byte given_to = NOBODY;
byte given;                     /* the newest session */
byte theirs;                    /* sessions that were the second operator's */
byte untold;                    /* the newest session whose end the robot has not confirmed */
byte reserved = NOBODY;         /* for whom the robot is taken over */
bool handed;                    /* the newest session began by a hand-over */

/* --- operators, and what they have sent: older letters first --------------------------------- */
byte knows[2];                  /* the session that an operator believes to have */
bool gone[2];                   /* is silent from now on */
typedef Letter { mtype kind; byte by; byte session; byte age; byte waits; bool here; bool before; bool old }
Letter letter[LETTERS];

/* --- what only the rules look at ------------------------------------------------------------ */
bool latched;                   /* an emergency, and nobody has released the robot since */
byte ended;                     /* sessions whose end the robot has heard of the DVA */
byte since, picture;            /* age of the command in force, and of its picture */

/* --- the step of the robot ------------------------------------------------------------------- */
hidden mtype message, state;
hidden byte source, named, at, i;       /* of the message; the session that it names; its letter */
hidden byte right, newer, still, later, released, fresh, somebody, current;

#define BIT(s) (1 << (s))

inline accept() { skip }
inline ask()    { wants = true }
inline stand()  { commanded = false; remains = 0; since = 0; picture = 0 }
inline idle()   { driven = false; silence = 0 }
inline lose()   { holder = NOBODY; session = 0 }
inline heard()  { silence = 0 }
inline latch() {
  latched = true;
  i = 0;
  do :: i < LETTERS -> if :: letter[i].here -> letter[i].before = true :: else fi; i++
     :: else -> break
  od
}
inline hold() {
  assert(!(BIT(told_session) & ended));                                 /* S2, S5 */
  assert(told_session == given -> !(handed && moving) : true);          /* S2 */
  if :: told_session == given -> handed = false :: else fi;
  holder = told_holder; session = told_session
}
inline count_order() {                  /* and with it every older one: START and STOP */
  assert(!letter[at].old);
  i = 0;
  do :: i <= at -> if :: letter[i].kind != SET && letter[i].session == session && letter[i].by == source ->
                         letter[i].old = true :: else fi; i++
     :: else -> break
  od
}
inline count_set() {                    /* commands are counted for themselves, from START on */
  i = 0;
  do :: i <= at -> if :: letter[i].kind == SET && letter[i].session == session && letter[i].by == source ->
                         letter[i].old = true :: else fi; i++
     :: else -> break
  od
}
inline acts() {
  assert(source == holder && named == session);                         /* S2 */
  assert(!(BIT(session) & ended));                                      /* S2 */
  assert(!letter[at].before)                                            /* S3 */
}
inline drive() {
  acts();
  assert(!moving);                                                      /* S2 */
  assert(!latched);                                                     /* S3 */
  driven = true
}
inline move() {
  acts();
  commanded = true; since = letter[at].waits; picture = letter[at].age;
#ifdef NO_AGE_LIMIT
  remains = WATCHDOG + 1 - letter[at].waits
#else
  remains = (WATCHDOG + 1 - letter[at].waits < MAX_AGE + 1 - letter[at].age ->
          WATCHDOG + 1 - letter[at].waits : MAX_AGE + 1 - letter[at].age)
#endif
}

#include "teleop_table.pml"

inline rules() {
  assert(!commanded || driven);                                                         /* S1 */
  assert(!(latched && commanded));                                                      /* S3 */
  assert(!driven || holder != NOBODY);                                                  /* S2 */
  assert(holder == NOBODY ||
         (session <= given && holder == ((theirs >> session) & 1)))                     /* S5 */
}

/* Decide on what `message`, `source` and `named` say. */
inline obey() {
  state = (holder == NOBODY -> FREE :
           (holder == source -> (driven -> DRIVES : HELD) : (driven -> OTHER_DRIVES : OTHER_HELD)));
  right = (holder != NOBODY && named == session);
  still = !moving;
  released = !latched;
#ifdef NO_LATCH
  released = true;
#endif
#ifdef NO_SESSION
  if :: message == START || message == SET || message == STOP -> right = true :: else fi;
#endif
#ifdef NO_ORDER
  newer = true;
#endif
#ifdef NO_STANDSTILL
  still = true;
#endif
#ifdef QUEUE_SURVIVES
  later = true;
#endif
#ifdef STALE_ANSWERS
  current = true;
#endif
#ifdef EMERGENCY_RESUMES
  if :: message == EMERGENCY -> stand(); latch() :: else -> decide() fi;
#else
  decide();
#endif
  rules();
  message = 0; state = 0; source = 0; named = 0; at = 0; i = 0;
  right = false; newer = false; still = false; later = false; released = false; fresh = false; somebody = false; current = false
}

inline remove(n) {
  i = n;
  do :: i < LETTERS - 1 ->
        letter[i].kind = letter[i+1].kind; letter[i].by = letter[i+1].by;
        letter[i].session = letter[i+1].session; letter[i].age = letter[i+1].age;
        letter[i].waits = letter[i+1].waits; letter[i].here = letter[i+1].here;
        letter[i].before = letter[i+1].before; letter[i].old = letter[i+1].old; i++
     :: else -> break
  od;
  letter[i].kind = 0; letter[i].by = 0; letter[i].session = 0; letter[i].age = 0;
  letter[i].waits = 0; letter[i].here = false; letter[i].before = false; letter[i].old = false;
  i = 0
}

/* --- what may happen to letters, in any order ------------------------------------------------ */
inline deliver(n) {
  message = letter[n].kind; source = letter[n].by; named = letter[n].session; at = n;
  newer = !letter[n].old; later = !letter[n].before;
  fresh = (letter[n].waits <= WATCHDOG
#ifndef NO_AGE_LIMIT
           && letter[n].age <= MAX_AGE
#endif
           );
  obey()
}

active proctype Network() {
  byte n;
  do
  :: d_step { letter[0].kind != 0 && !letter[0].here -> letter[0].here = true }
  :: d_step { letter[0].kind != 0 -> remove(0) }                        /* lost */
#if LETTERS > 1
  :: d_step { letter[1].kind != 0 && !letter[1].here -> letter[1].here = true }
  :: d_step { letter[1].kind != 0 -> remove(1) }
#endif
#if LETTERS > 2
  :: d_step { letter[2].kind != 0 && !letter[2].here -> letter[2].here = true }
  :: d_step { letter[2].kind != 0 -> remove(2) }
#endif
  od
}

/* A letter that was decided on stays: its copy comes later, or is lost. */
active proctype RobotReads() {
  do
  :: d_step { letter[0].here -> deliver(0) }
#if LETTERS > 1
  :: d_step { letter[1].here -> deliver(1) }
#endif
#if LETTERS > 2
  :: d_step { letter[2].here -> deliver(2) }
#endif
  od
}

#if LIVE == 2
bool pressed;                   /* an emergency is under way */
active proctype Anybody() { do :: d_step { !pressed -> pressed = true } :: break od }
#ifdef EMERGENCY_QUEUES
#define IS_PRESSED pressed && !letter[0].here -> pressed = false
#else
#define IS_PRESSED pressed -> pressed = false
#endif
#else
#define IS_PRESSED true
#endif

active proctype RobotStops() {
  do
  :: d_step { IS_PRESSED; message = EMERGENCY; source = NOBODY; obey() }
#if LIVE == 1
  :: break                              /* no rule may need one */
#endif
  od
}

#ifndef LIVE                            /* to stop, and to end a drive, takes nobody */
active proctype Person() {
  do
  :: d_step { latched -> latched = false }
  od
}
#endif

/* --- claims in the DVA's name, and its answers ------------------------------------------------ */
inline claim(kind, who, which) {
  message = kind; source = who; named = which;
#ifdef NO_CONFIRMATION
  if :: kind == GRANT -> holder = who; session = which; idle(); stand(); rules() :: else -> obey() fi
#else
  obey()
#endif
}
inline is_over(which) { if :: asked -> over = over | BIT(which) :: else fi }

/* The end of a session is said until this has arrived; copies are as a forger's. */
active proctype RobotHearsRevocation() {
  do
  :: d_step { untold != 0 ->
       is_over(untold); ended = ended | BIT(untold);
       claim(REVOKE, (theirs >> untold) & 1, untold);
       untold = 0 }
  od
}

active proctype RobotAsks() {
  do
  :: d_step { wants && !asked -> wants = false; asked = true; over = 0 }
  :: d_step { answered ->
       message = ANSWER; source = told_holder; named = told_session;
       somebody = (told_holder != NOBODY); current = !(over & BIT(told_session)) || !somebody;
       if :: told_holder == NOBODY -> source = 0 :: else fi;
       asked = false; answered = false; over = 0;
       obey();
       told_holder = NOBODY; told_session = 0 }
  :: d_step { asked && !answered -> asked = false; over = 0; wants = true }     /* lost */
  od
}

/* Grants of the DVA are no more than that, either. */
active proctype Forger() {
  byte s;
  do
  :: atomic {
       s = 1;
       do :: s < SESSIONS -> s++ :: break od;
       if
       :: d_step { claim(GRANT, 0, s) }
       :: d_step { claim(GRANT, 1, s) }
#ifndef LIVE                            /* it can stop a drive as often as it likes */
       :: d_step { is_over(s); claim(REVOKE, 0, s) }
#endif
       fi;
       s = 0 }
  od
}

/* --- the DVA --------------------------------------------------------------------------------- */
inline give(who) {
  given++; given_to = who; theirs = theirs | (who << given)
}
inline take_back() {
  untold = given; given_to = NOBODY
}

active proctype Dva() {
  do
  /* whoever asks first for a free robot gets it */
  :: d_step { given_to == NOBODY && reserved == NOBODY && given < SESSIONS -> give(0); handed = false }
  :: d_step { given_to == NOBODY && reserved == NOBODY && given < SESSIONS -> give(1); handed = false }
  :: d_step { given_to != NOBODY && untold == 0 -> take_back() }
  /* a hand-over: the last session has ended, the robot stands, and the next one begins */
  :: d_step { given_to != NOBODY && untold == 0 && given < SESSIONS -> reserved = 1 - given_to; take_back() }
#ifdef HAND_OVER_MOVING
  :: d_step { reserved != NOBODY -> untold = 0;
#else
  :: d_step { reserved != NOBODY && untold == 0 && !driven && !moving ->
#endif
       give(reserved); handed = true; reserved = NOBODY }
  :: d_step { reserved != NOBODY && untold == 0 -> reserved = NOBODY }          /* given up */
#ifdef NO_REMINDER
  :: d_step { untold != 0 -> untold = 0 }
#endif
#ifdef LIVE
  :: break                              /* it need not decide anything more, ... */
#endif
  od
}

active proctype DvaAnswers() {          /* ... but answers */
  do
  :: d_step { asked && !answered -> answered = true; told_holder = given_to; told_session = (given_to == NOBODY -> 0 : given) }
  od
}

/* --- the operators --------------------------------------------------------------------------- */
inline send(what, who) {
  i = 0;
  do :: letter[i].kind != 0 -> i++ :: else -> break od;
  letter[i].kind = what; letter[i].by = who; letter[i].session = knows[who];
  i = 0
}
#define ROOM (letter[LETTERS-1].kind == 0)

proctype Operator(bit who) {
  do
  :: d_step { !gone[who] && given_to == who && knows[who] != given -> knows[who] = given }
  :: d_step { !gone[who] && ROOM -> send(START, who) }
  :: d_step { !gone[who] && ROOM -> send(SET, who) }
  :: d_step { !gone[who] && ROOM -> send(STOP, who) }
#if LIVE == 1
  :: d_step { !gone[who] -> gone[who] = true } -> break
#endif
  od
}

/* --- time ------------------------------------------------------------------------------------- */
#ifdef NO_AGE_LIMIT
#define TOO_OLD(n) skip
#else                           /* one way of being too old is enough */
#define TOO_OLD(n) if :: letter[n].age > MAX_AGE || letter[n].waits > WATCHDOG -> \
                         letter[n].age = MAX_AGE + 1; letter[n].waits = WATCHDOG + 1 :: else fi
#endif
inline older(n) {
  if :: letter[n].kind == SET && letter[n].age <= MAX_AGE -> letter[n].age++ :: else fi;
  if :: letter[n].kind == SET && letter[n].here && letter[n].waits <= WATCHDOG -> letter[n].waits++ :: else fi;
  TOO_OLD(n)
}

active proctype Clock() {
  do
  :: d_step {
       older(0);
#if LETTERS > 1
       older(1);
#endif
#if LETTERS > 2
       older(2);
#endif
       moving = commanded;
       if :: commanded ->
#ifndef NO_WATCHDOG
             remains--;
             if :: remains == 0 -> stand() :: else since++; picture++ fi
#else
             if :: since <= WATCHDOG -> since++ :: else fi
#endif
          :: else fi;
       assert(!commanded || (since <= WATCHDOG && picture <= MAX_AGE));                 /* S1 */
#ifndef NO_LEASE
       if :: driven && silence < LEASE -> silence++
          :: driven && silence == LEASE -> idle(); stand()
          :: else fi;
#endif
       rules() }
  od
}

init { atomic { run Operator(0); run Operator(1) } }

/* --- what has to come, if nothing that is due is put off for ever -------------------------------- */
#if LIVE == 1
#define silent_driver (driven && gone[holder])
#define drive_is_over (driven && (session != given || given_to == NOBODY))
ltl drive_ends      { [] ((silent_driver || drive_is_over) -> <> !(silent_driver || drive_is_over)) }
#endif
#if LIVE == 2
ltl emergency_stops { [] (pressed -> <> (latched && !moving)) }
#endif
