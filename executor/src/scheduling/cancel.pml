/* Promela model of ExecutorCore::cancel() and OneThreadLoop::run(): ending from a signal handler.
 *
 * The thread that spins passes over its callbacks and sleeps on its futex word (wakeup.pml). A signal
 * handler calls stop(): on a thread of its own, step by step, or on the very thread that spins, which
 * stands still meanwhile and whose system call it interrupts. A message may arrive at any time.
 *
 * Shown: the spinning thread ends, whatever it was doing when the signal came, and after it at most
 * one more pass begins (a bounded stop); no lock is taken on the way.
 *
 * -DBUG: the thread is woken before the flag is set.
 */
mtype = { idle, signalled, waiting };

mtype word = idle;
bool is_stopped = false;
bool asleep = false;
bool has_ended = false;
byte passes_after = 0; /* passes that began after stop() had returned */
bool stop_returned = false;

inline notify(before) {
  atomic { before = word; word = signalled; }
  if
  :: before == waiting -> asleep = false
  :: else
  fi
}

inline stop(before) {
#ifdef BUG
  notify(before);
  is_stopped = true;
#else
  is_stopped = true;
  notify(before);
#endif
}

proctype HandlerElsewhere() {
  mtype before;
  stop(before);
  stop_returned = true
}

/* On the spinning thread: nothing of that thread happens meanwhile, and its wait ends with EINTR. */
proctype HandlerOnTop() {
  mtype before;
  atomic {
    !has_ended -> stop(before);
    asleep = false;
    stop_returned = true
  }
}

proctype Message() {
  mtype before;
  notify(before)
}

proctype Spinner() {
  mtype found;
  do
  :: is_stopped -> break
  :: else ->
     /* pass() */
     if
     :: stop_returned -> passes_after++; assert(passes_after <= 1)
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
     fi
  od;
  has_ended = true
}

active proctype Quiescence() {
  timeout -> assert(has_ended)
}

init {
  atomic {
    run Spinner(); run Message();
    if
    :: run HandlerElsewhere()
    :: run HandlerOnTop()
    :: run HandlerElsewhere(); run HandlerElsewhere()
    fi
  }
}
