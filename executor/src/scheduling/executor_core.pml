/* Promela model of ExecutorCore: teams that leave, cancellation and the end of spin().
 *
 * Two teams of one thread each, of which each may run one instance. An instance withdraws callbacks
 * without waiting, or destroys the executor; a thread outside of all callbacks withdraws and waits, or
 * destroys the executor; or the thread that spins destroys it after spin(), while another, as a signal
 * handler does, has cancelled it. One of them owns the executor. Sets of teams are bits; what happens
 * under the lock of ExecutorCore is one step. The executor goes with the last that refers to it: its
 * owner, spin(), or whoever withdraws a callback just now.
 *
 * Shown: no thread joins itself, who ends the executor included; cancel() does not touch an executor
 * that is gone; a cancelled spin() returns; every thread that leaves is joined.
 *
 * -DBUG_DEPARTING: spin() does not wait for those who are about to add to the teams that leave.
 * -DBUG_CANCELLING: spin() does not wait for those who cancel.
 * -DBUG_JOIN: spin() joins the teams that it stopped, and not those that a callback did.
 */
#define TEAMS 3 /* as bits: 1 and 2 */
#define OUTSIDE 0

mtype = { team_1, team_2, outsider, spinner };

mtype owner;
byte references = 2; /* its owner's and spin()'s */
bool is_gone = false;

byte placed = TEAMS; /* in the placement */
byte departed = 0;
byte departing = 0;
byte cancelling = 0;
bool is_cancelled = false;
bool is_spinning = true;

byte stopped = 0;
byte left = 0;
byte joined = 0;
bool was_cancelled = false;

/* `me`: the team of the calling thread. */
inline join(me, teams) {
  assert(((teams) & me) == 0);
  (left & (teams)) == (teams);
  atomic { joined = joined | (teams) }
}

inline release(me) {
  atomic { references--; is_last = (references == 0); is_gone = is_last }
  if
  :: is_last ->
     stopped = stopped | placed | departed;
     join(me, placed | departed)
  :: else
  fi
}

inline cancel() {
  assert(!is_gone);
  cancelling++;
  atomic { is_cancelled = true; was_cancelled = true }
  assert(!is_gone); /* the placement's cancel() */
  cancelling--
}

inline withdraw_and_wait(teams) {
  atomic { assert(!is_gone); taken = (teams) & placed; placed = placed & ~taken }
  stopped = stopped | taken;
  join(OUTSIDE, taken);
  atomic { taken = departed & left; departed = departed & ~taken }
  join(OUTSIDE, taken);
  taken = 0
}

inline withdraw(me, teams) {
  atomic { assert(!is_gone); taken = (teams) & placed; placed = placed & ~taken; departing++ }
  stopped = stopped | taken;
  atomic { assert(!is_gone); departed = departed | taken; taken = 0; departing-- }
}

inline refer() {
  atomic { refers = (references > 0); references = references + refers }
}

proctype Thread(byte me; mtype name) {
  byte taken, actions;
  bool is_last, refers;
  if
  :: stopped & me
  :: !(stopped & me) -> /* an instance */
     do
     :: actions < 2 ->
        actions++;
        refer();
        if
        :: refers ->
           if
           :: withdraw(me, 1)
           :: withdraw(me, 2)
           fi;
           release(me)
        :: else
        fi
     :: owner == name ->
        owner = 0;
        cancel();
        withdraw(me, TEAMS);
        release(me)
     :: true -> break
     od;
end_idle:
     stopped & me
  fi;
  atomic { left = left | me }
}

proctype Outsider() {
  byte taken;
  bool is_last, refers;
  if
  :: refer();
     if
     :: refers ->
        if
        :: withdraw_and_wait(1)
        :: withdraw_and_wait(2)
        fi;
        release(OUTSIDE)
     :: else
     fi
  :: true
  fi;
  if
  :: owner == outsider ->
     cancel();
     withdraw_and_wait(TEAMS);
     !is_spinning;
     release(OUTSIDE)
  :: else
  fi
}

proctype Canceller() {
  cancel()
}

proctype Spinner() {
  byte taken;
  bool is_last;
end_run:
  is_cancelled; /* the placement's run() */
#ifndef BUG_CANCELLING
  cancelling == 0;
#endif
  atomic { taken = placed } /* the placement's stop() */
  stopped = stopped | taken;
  join(OUTSIDE, taken);
#ifndef BUG_JOIN
  do
  ::
#ifndef BUG_DEPARTING
     departing == 0;
#endif
     atomic { taken = departed; departed = 0 }
     if
     :: taken == 0 -> break
     :: else -> join(OUTSIDE, taken)
     fi
  od;
#endif
  is_cancelled = false;
  atomic { placed = 0; taken = 0 } /* the placement's clear() */
  is_spinning = false;
  release(OUTSIDE);
  if
  :: owner == spinner ->
     cancel();
     withdraw_and_wait(TEAMS);
     release(OUTSIDE)
  :: else
  fi
}

active proctype Quiescence() {
  timeout -> assert(!was_cancelled || (!is_spinning && joined == TEAMS))
}

init {
  atomic {
    if
    :: owner = team_1
    :: owner = outsider
    :: owner = spinner; run Canceller()
    fi;
    run Thread(1, team_1); run Thread(2, team_2); run Outsider(); run Spinner()
  }
}
