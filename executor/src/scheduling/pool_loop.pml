/* Promela model of pool_loop.cpp and event_count.hpp: several threads, one queue, one leader.
 *
 * Two threads serve a callback M of messages and a timer T; no instance of either overlaps itself. A
 * deliverer marks M ready and notifies, without the lock that the threads share; a clock makes T due.
 * An instance of M takes as long as it takes T to run as often as it is due. At some time, or when all
 * is done, somebody stops the loop. The kernel compares and sleeps in one step.
 *
 * Shown: M and T never overlap themselves; when nothing else can happen, no message waits and T is not
 * due (no lost wake-up, and a long instance holds up nobody while a thread is idle); both threads leave
 * a loop that is stopped; whoever delivers waits for nothing.
 *
 * -DBUG_TICKET: a thread takes its ticket after it has looked.
 * -DBUG_STOP: a thread looks whether it is to leave before it takes its ticket.
 * -DBUG_SLEEPERS: who notifies looks for sleepers before it counts.
 * -DBUG_LEAD: who takes work does not hand over the lead.
 * -DBUG_FINISH: who has run T does not wake a leader that does not know T's next expiry.
 */
#define THREADS 2
#define M 0
#define T 1
#define NOTHING 2

mtype = { armed, due, over };

byte count = 0;            /* EventCount */
byte sleepers = 0;
bool asleep[THREADS];

byte queue = 0;            /* messages that wait, one at most */
bool mark = false;         /* of M */
mtype timer = due;
byte expiries = 1;         /* still to come */

bool locked = false;       /* the lock of what follows */
bool running[2];
byte idle = 0;
bool has_leader = false;
bool leader_has_timer = false;

bool is_stopped = false;
byte left = 0;

inline lock() { atomic { !locked; locked = true } }
inline unlock() { locked = false }

inline notify(is_for_all) {
#ifdef BUG_SLEEPERS
  has_sleepers = (sleepers > 0);
  count++;
#else
  count++;
  has_sleepers = (sleepers > 0);
#endif
  atomic {
    if
    :: has_sleepers && is_for_all -> asleep[0] = false; asleep[1] = false
    :: has_sleepers && !is_for_all && asleep[0] -> asleep[0] = false
    :: has_sleepers && !is_for_all && asleep[1] -> asleep[1] = false
    :: else
    fi;
    has_sleepers = false
  }
}

proctype Deliverer() {
  bool has_sleepers;
  atomic { queue++; mark = true } /* on_ready() */
  notify(false)
}

proctype Clock() {
end_clock:
  atomic { timer == armed -> timer = due; expiries-- }
}

inline stop() {
  is_stopped = true;
  notify(true)
}

/* pick(), with the lock: M's mark may be set meanwhile. */
inline pick() {
  atomic {
    if
    :: !running[M] && mark -> mark = false; found = M
    :: else -> found = NOTHING
    fi
  }
  atomic {
    if
    :: found == NOTHING && !running[T] && timer == due -> found = T
    :: else
    fi
  }
}

inline wait() {
  atomic {
    is_leader = !has_leader;
    if
    :: is_leader -> leader_has_timer = (timer == armed || (timer == due && !running[T]))
    :: else
    fi;
    has_leader = true;
    idle++;
    knows_timer = is_leader && leader_has_timer;
    unlock()
  }
  sleepers++;
  atomic { asleep[me] = (count == ticket) }
  if
  :: !asleep[me]
  :: knows_timer && timer == due -> asleep[me] = false /* its deadline */
  fi;
  sleepers--;
  atomic {
    !locked;
    locked = true;
    idle--;
    if
    :: is_leader -> has_leader = false; is_leader = false
    :: else
    fi;
    knows_timer = false
  }
}

proctype Thread(byte me) {
  byte ticket, found;
  bool is_leader, knows_timer, is_unknown, has_run, has_sleepers, leaves;
  lock();
  do
  :: leaves -> break
  :: else ->
#ifdef BUG_STOP
     leaves = is_stopped;
     ticket = count;
#else
     ticket = count;
     leaves = is_stopped;
#endif
     if
     :: leaves
     :: else ->
        pick();
#ifdef BUG_TICKET
        ticket = count;
#endif
        if
        :: found == NOTHING -> wait()
        :: else ->
           atomic { assert(!running[found]); running[found] = true }
#ifndef BUG_LEAD
           if
           :: idle > 0 && !has_leader -> notify(false)
           :: else
           fi;
#endif
           unlock();
           has_run = false;
           if
           :: found == T -> atomic { timer = (expiries > 0 -> armed : over); has_run = true }
           :: else ->
              atomic {
                if
                :: queue > 0 -> queue--; has_run = true
                :: else
                fi
              }
              if
              :: has_run -> timer == over || is_stopped
              :: else
              fi
           fi;
           atomic { /* finish() */
             !locked;
             locked = true;
             mark = mark || (has_run && found == M);
             running[found] = false;
             is_unknown = has_leader && !leader_has_timer && timer != over
           }
#ifndef BUG_FINISH
           if
           :: is_unknown -> notify(true)
           :: else
           fi;
#endif
           atomic { found = NOTHING; has_run = false; is_unknown = false }
        fi
     fi
  od;
  unlock();
  left++
}

/* At any time, or when nothing else can happen. */
active proctype Stopper() {
  bool has_sleepers;
  if
  :: true -> goto now
  :: true
  fi;
  timeout -> assert(queue == 0 && timer == over);
now:
  stop();
  timeout -> assert(left == THREADS)
}

init {
  atomic { run Deliverer(); run Clock(); run Thread(0); run Thread(1) }
}
