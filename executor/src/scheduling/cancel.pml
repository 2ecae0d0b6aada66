/* Promela model of ExecutorCore::cancel() and OneThreadLoop::run(): ending from a signal handler.
 *
 * The thread that spins passes over its callbacks and sleeps on its futex word (wakeup.pml). A signal
 * handler cancels: on a thread of its own, step by step, or on the very thread that spins, which
 * stands still meanwhile and whose system call it interrupts. Messages may arrive at any time. For an
 * instance the thread takes a message, and looks at the flag again before the instance begins.
 *
 * Shown: the spinning thread ends, whatever it was doing when the signal came; no instance begins once
 * cancel() has returned; a message is taken for an instance that begins, or waits in the end; no lock
 * is taken on the way.
 *
 * -DBUG: the thread is woken before the flag is set.
 * -DBUG_BEGIN: the thread does not look again before the instance begins.
 * -DBUG_LOST: what was taken for an instance that does not begin is not kept.
 */
#define MESSAGES 2
mtype = { idle, signalled, waiting };

mtype word = idle;
bool is_cancelled = false;
bool asleep = false;
bool has_ended = false;
bool cancel_returned = false;
byte waiting_messages = 0;
byte instances = 0;

inline notify(before) {
  atomic { before = word; word = signalled; }
  if
  :: before == waiting -> asleep = false
  :: else
  fi
}

inline cancel(before) {
#ifdef BUG
  notify(before);
  is_cancelled = true;
#else
  is_cancelled = true;
  notify(before);
#endif
}

proctype HandlerElsewhere() {
  mtype before;
  cancel(before);
  cancel_returned = true
}

/* On the spinning thread: nothing of that thread happens meanwhile, and its wait ends with EINTR. */
proctype HandlerOnTop() {
  mtype before;
  atomic {
    !has_ended -> cancel(before);
    asleep = false;
    cancel_returned = true
  }
}

proctype Message() {
  mtype before;
  waiting_messages++;
  notify(before)
}

inline begin() {
  assert(!cancel_returned);
  instances++
}

proctype Spinner() {
  mtype found;
  bool has_taken;
  do
  :: is_cancelled -> break
  :: else ->
     /* pass() */
     atomic {
       has_taken = (waiting_messages > 0);
       if
       :: has_taken -> waiting_messages--
       :: else
       fi
     }
     if
     :: has_taken ->
#ifdef BUG_BEGIN
        begin();
#else
        atomic {
          if
          :: !is_cancelled -> begin()
#ifdef BUG_LOST
          :: else
#else
          :: else -> waiting_messages++
#endif
          fi
        }
#endif
        goto passed
     :: else
     fi;
     found = idle;
     atomic {
       if
       :: word == idle -> word = waiting; found = waiting
       :: else
       fi
     }
     if
     :: found != waiting -> word = idle
     :: else ->
        atomic { asleep = (word == waiting); }
        !asleep;
        atomic { found = word; word = idle; }
     fi;
passed: skip
  od;
  has_ended = true
}

active proctype Quiescence() {
  timeout -> assert(has_ended && instances + waiting_messages == MESSAGES)
}

init {
  atomic {
    run Spinner(); run Message(); run Message();
    if
    :: run HandlerElsewhere()
    :: run HandlerOnTop()
    :: run HandlerElsewhere(); run HandlerElsewhere()
    fi
  }
}
