/* Promela model of events_loop.cpp: the list of ready callbacks through the callbacks themselves.
 *
 * Two threads deliver messages to two callbacks; one of the callbacks is also a timer's. The serving
 * thread takes the list of arrivals, puts what is due beside it, runs one instance and puts the
 * callback to the end again if its queue may hold more. How it sleeps is wakeup.pml's concern: here a
 * flag that notify() sets.
 *
 * Shown: nothing waits in a queue when nothing else can happen (no callback is never served); no
 * callback stands in the list twice; no instance of a callback runs without being asked for more
 * often than it was marked (none is served twice for one mark); the list never loses an element.
 *
 * -DBUG: the mark is taken after the instance instead of before it.
 */
#define N 2     /* callbacks */
#define NONE 255
#define MESSAGES 1 /* of each deliverer */

byte queue[N];       /* messages that wait */
bool mark[N];
byte next[N];
byte listed[N];      /* how often it stands in either list */
byte arrived = NONE; /* latest first; any thread pushes */
bool notified = true;
byte due = 1;        /* expiries of callback 0's timer still to come */
bool is_due = false;

inline on_ready(c) {
  atomic { was = mark[c]; mark[c] = true; }
  if
  :: was
  :: else ->
     listed[c]++;
     assert(listed[c] == 1);
     head = arrived;
     do
     :: next[c] = head;
        atomic {
          if
          :: arrived == head -> arrived = c; break
          :: else -> head = arrived
          fi
        }
     od;
     notified = true
  fi
}

proctype Deliverer() {
  byte head;
  byte sent;
  byte to;
  bool was;
  do
  :: sent < MESSAGES ->
     if
     :: to = 0
     :: to = 1
     fi;
     queue[to]++;
     on_ready(to);
     sent++
  :: else -> break
  od
}

proctype Timer() {
  do
  :: due > 0 -> due--; is_due = true; notified = true
  :: else -> break
  od
}

/* The serving thread's own list, oldest first. */
byte first = NONE;
byte last = NONE;

inline append(c) {
  next[c] = NONE;
  if
  :: last == NONE -> first = c
  :: else -> next[last] = c
  fi;
  last = c
}

proctype Server() {
  byte taken;
  byte ahead;
  byte oldest;
  byte c;
  bool was;
  bool has_run;
  do
  :: /* collect(): the arrivals, in the order in which they came */
     atomic { taken = arrived; arrived = NONE; }
     oldest = NONE;
     do
     :: taken != NONE -> ahead = next[taken]; next[taken] = oldest; oldest = taken; taken = ahead
     :: else -> break
     od;
     do
     :: oldest != NONE -> ahead = next[oldest]; append(oldest); oldest = ahead
     :: else -> break
     od;
     /* collect_due() */
     if
     :: is_due ->
        atomic { was = mark[0]; mark[0] = true; }
        if
        :: was
        :: else -> listed[0]++; assert(listed[0] == 1); append(0)
        fi
     :: else
     fi;
     /* pass() */
     if
     :: first == NONE -> end_wait: atomic { notified -> notified = false }
     :: else ->
        c = first;
        first = next[c];
        if
        :: first == NONE -> last = NONE
        :: else
        fi;
        assert(listed[c] == 1);
        listed[c]--;
#ifndef BUG
        assert(mark[c]);
        mark[c] = false;
#endif
        has_run = false;
        if
        :: c == 0 && is_due -> is_due = false; has_run = true
        :: else ->
           atomic {
             if
             :: queue[c] > 0 -> queue[c]--; has_run = true
             :: else
             fi
           }
        fi;
#ifdef BUG
        mark[c] = false;
#endif
        if
        :: has_run ->
           atomic { was = mark[c]; mark[c] = true; }
           if
           :: was
           :: else -> listed[c]++; assert(listed[c] == 1); append(c)
           fi
        :: else
        fi
     fi
  od
}

active proctype Quiescence() {
  timeout -> assert(queue[0] == 0 && queue[1] == 0 && !is_due)
}

init {
  atomic {
    next[0] = NONE; next[1] = NONE;
    run Deliverer(); run Deliverer(); run Timer(); run Server()
  }
}
