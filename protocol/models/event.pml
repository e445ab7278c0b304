/* An event, and everything that may become of it: a policy that sends somebody or not, whoever is
 * sent, who may say anything or nothing, reports without end, and a DVA that looks at deadlines.
 *
 *   spin -a event.pml && cc -O2 -DNFAIR=4 -o pan pan.c && ./pan -a -f -m400000 -N event_ends
 *
 * The event obeys event_table.pml, which is taken from the program. Bounds: -DATTEMPTS=4, -DWAITS=3,
 * -DLIMIT=3. A mechanism is left out by -DNO_...; then the event need not end.
 * Time passes in ticks of a minute or so. What people at a control room decide is not in it.
 */
#ifndef ATTEMPTS
#define ATTEMPTS 3              /* orders that are taken up before it is given up */
#endif
#ifndef WAITS
#define WAITS 2                 /* so long it may wait */
#endif
#ifndef LIMIT
#define LIMIT 2                 /* so long an order may last */
#endif

mtype = { PENDING, ORDERED, TAKEN_UP, UNDER_WAY, ON_SCENE, CONFIRMED, ACTOR_ORDERED, ACTOR_TAKEN_UP, CLOSED };
mtype = { SEND, TAKE_UP, DECLINE, DEPART, ARRIVE, CONFIRM, REFUTE, CONTAIN, END, FAIL, VANISH,
          CALL_AWAY, REPORT, DEADLINE, ORDER_LIMIT };

mtype state = PENDING;
byte attempts;                  /* orders that were taken up */
byte waited;                    /* since it was reported, or waits again */
byte lasted;                    /* the order that stands */
hidden mtype what, before;
hidden byte late, last;

#define COUNTED  (before == TAKEN_UP || before == UNDER_WAY || before == ON_SCENE)
#define IN_HANDS (state != PENDING && state != CONFIRMED && state != CLOSED)

inline into(next)   { if :: (next == ORDERED || next == ACTOR_ORDERED || next == PENDING || next == CONFIRMED) -> lasted = 0 :: else fi; state = next }
inline attempt()    { attempts++ }
inline no_attempt() { attempts-- }
inline wait_again()  { waited = 0 }

#include "event_table.pml"

inline happens(which) {
  what = which; before = state;
  late = (waited > WAITS);
  last = (attempts + (COUNTED -> 0 : 1) >= ATTEMPTS);
#ifdef NO_LAST_ATTEMPT
  last = false;
#endif
  decide();
#ifdef WAIT_AGAIN_AFTER_DECLINE
  if :: what == DECLINE || what == CALL_AWAY -> waited = 0 :: else fi;
#endif
#ifdef REPORTS_RESET
  if :: what == REPORT -> waited = 0 :: else fi;
#endif
  assert(state == CLOSED || attempts <= ATTEMPTS + 1);
  assert(!(before == CLOSED) || state == CLOSED);                       /* S6 */
  what = 0; before = 0; late = false; last = false
}

/* Sends somebody whenever it likes, and calls away who is on the way. */
active proctype Policy() {
  do
  :: d_step { state == PENDING || state == CONFIRMED -> happens(SEND) }
  :: d_step { IN_HANDS -> happens(CALL_AWAY) }
  :: break                              /* or sends nobody any more */
  od
}

/* Says anything, in any order, or nothing any more; or is not heard. */
active proctype Responder() {
  do
  :: d_step { IN_HANDS -> happens(TAKE_UP) }
  :: d_step { IN_HANDS -> happens(DECLINE) }
  :: d_step { IN_HANDS -> happens(DEPART) }
  :: d_step { IN_HANDS -> happens(ARRIVE) }
  :: d_step { IN_HANDS -> happens(CONFIRM) }
  :: d_step { IN_HANDS -> happens(REFUTE) }
  :: d_step { IN_HANDS -> happens(CONTAIN) }
  :: d_step { IN_HANDS -> happens(END) }
  :: d_step { IN_HANDS -> happens(FAIL) }
  :: d_step { IN_HANDS -> happens(VANISH) }
  :: break
  od
}

active proctype Reporter() { do :: d_step { state != CLOSED -> happens(REPORT) } od }

/* The DVA looks at deadlines as time passes: no step can be put off for ever by another. */
active proctype Clock() {
  do
  :: d_step { state != CLOSED ->
       if :: waited <= WAITS -> waited++ :: else fi;
       if :: IN_HANDS && lasted <= LIMIT -> lasted++ :: else fi;
#ifndef NO_DEADLINE
       if :: state == PENDING || state == CONFIRMED -> happens(DEADLINE) :: else fi;
#endif
#ifndef NO_ORDER_LIMIT
       if :: IN_HANDS && lasted > LIMIT -> happens(ORDER_LIMIT) :: else fi
#endif
     }
  od
}

ltl event_ends { <> (state == CLOSED) }
