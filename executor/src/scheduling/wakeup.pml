/* Promela model of wakeup.hpp: one futex word between one waiting thread and those that notify it.
 *
 * Two threads hand over one piece of work each and call notify(). The waiting thread takes all work
 * there is and calls wait_until(), whose system call may also return by a timeout or for no reason
 * at all. Each exchange of the word is one step; the futex compares and sleeps in one step, as the
 * kernel does under its own lock. Spin explores sequentially consistent interleavings: that the
 * exchanges order the work itself is what their acquire and release say, not what is shown here.
 *
 * Shown: whoever sleeps when nothing else can happen has no work left (no lost wake-up); the word is
 * idle whenever wait_until() has returned and nobody notified since; a notifier makes the system
 * call only if somebody waits.
 *
 * -DBUG: wait_until() announces that it waits without looking whether it was signalled meanwhile.
 */
mtype = { idle, signalled, waiting };

mtype word = idle;
byte work = 0;        /* handed over and not taken */
bool asleep = false;  /* the thread is on the futex' queue */
byte calls = 0;       /* system calls of notifiers in a row without a sleeper in between */

inline notify() {
  atomic { before = word; word = signalled; }
  if
  :: before == waiting -> asleep = false; /* FUTEX_WAKE */
  :: else
  fi
}

proctype Notifier() {
  mtype before;
  work++;
  notify();
}

active proctype Waiter() {
  mtype found;
  do
  :: /* takes all there is */
     d_step { work = 0; found = idle; }
#ifdef BUG
     word = waiting;
#else
     atomic {
       if
       :: word == idle -> word = waiting; found = waiting
       :: else
       fi
     }
     if
     :: found != waiting -> word = idle; goto taken /* not_waited */
     :: else
     fi;
#endif
     atomic { asleep = (word == waiting); } /* FUTEX_WAIT compares and sleeps */
     if
     :: !asleep                /* woken, or the word was another already */
     :: asleep -> asleep = false; skip /* the deadline, a signal, or nothing at all */
     :: asleep -> end_sleep: !asleep   /* a wait without end */
     fi;
     atomic { found = word; word = idle; }
taken: skip
  od
}

active proctype Quiescence() {
  timeout -> assert(work == 0)
}

init {
  atomic { run Notifier(); run Notifier(); }
}
