/* Promela model of callback.cpp: the word in which a callback counts its instances and ends.
 *
 * Callback A is in a reentrant group with two threads, B has one thread. Each thread runs an instance
 * that may end either callback, or take it off its threads as remove_node() does; a thread outside of all callbacks ends both; and what A's function
 * holds may end B as it is destroyed. The stack of a thread is the set of callbacks on it. What happens
 * under the mutex of the ends is one step; so is each atomic operation on the word.
 *
 * Shown: a callback is disposed of once, while none of its instances runs, and in the end always;
 * nobody waits for ever; and whoever ends a callback from outside finds it disposed of.
 *
 * -DBUG_COUNT: an instance looks whether the callback is closed before it counts itself.
 * -DBUG_LAST: the last instance leaves disposal to end().
 * -DBUG_WAIT: end() waits without asking who waits for whom.
 * -DBUG_REMOVE: remove_node() does.
 */
#define A 0
#define B 1
#define CALLBACKS 2
#define THREADS 4
#define OUTSIDE 3
#define NOBODY 255

#define CLOSED 1
#define DISPOSING 2
#define DISPOSED 4
#define RUNNING 8

#define bit(callback) (1 << (callback))

byte life[CALLBACKS];
byte inside[CALLBACKS];    /* instances in run_one() */
byte disposals[CALLBACKS];
byte stack[THREADS];       /* Frame: a set of callbacks */
byte target[THREADS];      /* Wait */
byte finished = 0;

/* waits_for(): what `callback` cannot end before, in as many steps as there are callbacks. */
inline find_cycle(me, callback) {
  before = bit(callback);
  i = 0;
  do
  :: i < CALLBACKS * THREADS ->
     if
     :: target[i % THREADS] != NOBODY && (stack[i % THREADS] & before) ->
        before = before | bit(target[i % THREADS])
     :: else
     fi;
     i++
  :: else -> break
  od;
  has_cycle = (before & stack[me]) != 0;
  before = 0;
  i = 0
}

inline await(me, callback) {
  atomic {
    if
    :: life[callback] & DISPOSED
    :: else ->
       find_cycle(me, callback);
#ifdef BUG_WAIT
       has_cycle = false;
#endif
       if
       :: has_cycle -> has_cycle = false
       :: else -> target[me] = callback
       fi
    fi
  }
  target[me] == NOBODY || (life[callback] & DISPOSED);
  target[me] = NOBODY;
  assert(stack[me] || (life[callback] & DISPOSED))
}

/* Refused, or returns when no instance of it runs; its thread takes up no other meanwhile. */
inline remove(me, callback) {
  atomic {
    find_cycle(me, callback);
#ifdef BUG_REMOVE
    has_cycle = false;
#endif
    if
    :: has_cycle -> has_cycle = false
    :: else -> target[me] = callback
    fi
  }
  target[me] == NOBODY || inside[callback] == 0;
  target[me] = NOBODY
}

/* Begins a disposal if it is this thread's, and saves the thread's stack in `held`. */
inline begin_disposal(me, callback, held) {
  atomic {
    is_mine = (life[callback] == CLOSED);
    if
    :: is_mine -> life[callback] = CLOSED | DISPOSING; held = stack[me]; stack[me] = held | bit(callback)
    :: else
    fi
  }
  if
  :: is_mine -> assert(inside[callback] == 0); disposals[callback]++; assert(disposals[callback] == 1)
  :: else
  fi
}

inline complete_disposal(me, callback, held) {
  atomic { stack[me] = held; held = 0; is_mine = false }
  atomic { life[callback] = life[callback] | DISPOSED }
}

/* end() of B, whose function holds no other callback. */
inline end_b(me) {
  atomic { life[B] = life[B] | CLOSED }
  begin_disposal(me, B, inner);
  if
  :: is_mine -> complete_disposal(me, B, inner)
  :: else
  fi;
  await(me, B)
}

inline try_dispose(me, callback) {
  begin_disposal(me, callback, outer);
  if
  :: is_mine ->
     if
     :: callback == A -> end_b(me)
     :: true
     fi;
     complete_disposal(me, callback, outer)
  :: else
  fi
}

inline end(me, callback) {
  atomic { life[callback] = life[callback] | CLOSED }
  try_dispose(me, callback);
  await(me, callback)
}

/* execute_one() */
proctype Thread(byte me; byte callback) {
  byte other = 1 - callback;
  byte before, i, outer, inner;
  bool is_open, is_last, is_mine, has_cycle;
#ifdef BUG_COUNT
  is_open = !(life[callback] & CLOSED);
  atomic { life[callback] = life[callback] + RUNNING; stack[me] = bit(callback) }
#else
  atomic {
    is_open = !(life[callback] & CLOSED);
    life[callback] = life[callback] + RUNNING;
    stack[me] = bit(callback)
  }
#endif
  if
  :: is_open ->
     atomic { inside[callback]++; assert(disposals[callback] == 0) }
     if
     :: end(me, A)
     :: end(me, B)
     :: remove(me, other)
     :: true
     fi;
     inside[callback]--
  :: else
  fi;
  atomic {
    is_last = (life[callback] == (CLOSED | RUNNING));
    life[callback] = life[callback] - RUNNING
  }
#ifndef BUG_LAST
  if
  :: is_last -> try_dispose(me, callback)
  :: else
  fi;
#endif
  atomic { stack[me] = 0; finished++ }
}

proctype Outside() {
  byte before, i, outer, inner;
  bool is_mine, has_cycle;
  end(OUTSIDE, A);
  end(OUTSIDE, B);
  atomic { finished++ }
}

active proctype Quiescence() {
  timeout -> assert(finished == THREADS && disposals[A] == 1 && disposals[B] == 1)
}

init {
  atomic {
    target[0] = NOBODY; target[1] = NOBODY; target[2] = NOBODY; target[OUTSIDE] = NOBODY;
    run Thread(0, A); run Thread(1, A); run Thread(2, B); run Outside()
  }
}
