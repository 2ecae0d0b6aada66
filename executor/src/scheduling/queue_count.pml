/* Promela model of queue_count.hpp: how many samples of a queue were pushed out before their take.
 *
 * The delivering thread puts samples into a queue of two and calls on_stored(); two threads of a
 * reentrant group take. A sample is in the queue before it is counted, and claimed before it is taken.
 *
 * Shown: the count is never above the number of samples that were pushed out; where no take is going
 * on, it is exact after an arrival in a full queue and after a take that came back empty.
 *
 * -DBUG: a take claims its sample only after it took it.
 */
#define DEPTH 2
#define SAMPLES 4
#define TAKES 2

byte queued = 0;
byte pushed_out = 0; /* the truth */
byte stored = 0;
byte claimed = 0;
byte overwritten = 0;
byte ended = 0; /* of the three threads */
byte taking = 0;
bool is_alone = false; /* no take overlapped the last arrival */

inline raise_to(value) {
  atomic {
    if
    :: overwritten < value -> overwritten = value
    :: else
    fi;
    assert(overwritten <= pushed_out)
  }
}

proctype Recorder() {
  byte accounted;
  byte now;
  byte i;
  do
  :: i < SAMPLES ->
     atomic {
       is_alone = (taking == 0);
       if
       :: queued == DEPTH -> pushed_out++
       :: else -> queued++
       fi
     }
     stored++;
     now = stored;
     accounted = claimed + DEPTH;
     if
     :: now > accounted -> raise_to(now - accounted)
     :: else
     fi;
     i++
  :: else -> break
  od;
  ended++
}

inline take() {
  atomic { taking++; is_alone = false; }
  before = stored;
#ifndef BUG
  claimed++;
#endif
  atomic {
    if
    :: queued > 0 -> queued--; is_empty = false
    :: else -> is_empty = true
    fi
  }
#ifdef BUG
  claimed++;
#endif
  if
  :: is_empty ->
     atomic { claimed--; mine = claimed }
     if
     :: before > mine -> raise_to(before - mine)
     :: else
     fi
  :: else
  fi;
  taking--
}

proctype Taker() {
  byte before;
  byte mine;
  byte i;
  bool is_empty;
  do
  :: i < TAKES -> take(); i++
  :: else -> break
  od;
  ended++
}

/* When all is done, one thread takes until nothing is left: then the count is exact. */
proctype Last() {
  byte before;
  byte mine;
  bool is_empty = false;
  ended == 3;
  assert(!is_alone || queued < DEPTH || overwritten == pushed_out);
  do
  :: !is_empty -> take()
  :: else -> break
  od;
  assert(overwritten == pushed_out)
}

init {
  atomic { run Recorder(); run Taker(); run Taker(); run Last(); }
}
