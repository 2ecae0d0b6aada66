/* Promela model of team.cpp and of ThreadPerGroup::place(): the gate behind which callbacks
 * run.
 *
 * Two teams of two threads and of one are started, each waited for, and their gates opened when all
 * are configured; somebody else may stop them at any moment. The mutex and the condition variable of
 * a team are one step: what a thread waits for and what it does then happens under the lock.
 *
 * Shown: no thread serves callbacks while a thread that was started with it is not configured; all
 * threads leave in the end; whoever waits for the configuration is not left waiting.
 *
 * -DBUG: the gate of a team opens when that team is configured, without regard to the others.
 */
#define TEAMS 2
#define THREADS 3

mtype = { closed, open, leave };

mtype gate[TEAMS] = closed;
byte unconfigured[TEAMS];
bool is_stopped[TEAMS]; /* the flag of the body's loop */
byte configured = 0;
byte left = 0;

inline set_gate(team, to) {
  atomic {
    if
    :: gate[team] == closed -> gate[team] = to
    :: else
    fi
  }
}

proctype Thread(byte team) {
  /* applies and reads back its parameters */
  configured++;
  atomic { unconfigured[team]--; }
  gate[team] != closed;
  if
  :: gate[team] == leave
  :: else ->
     /* the loop runs: each instance is a step in which all must be configured */
     do
     :: !is_stopped[team] -> assert(configured == THREADS)
     :: is_stopped[team] -> break
     od
  fi;
  atomic { left++; }
}

proctype Starter() {
  byte team = 0;
  run Thread(0);
  run Thread(0);
  run Thread(1);
  do
  :: team < TEAMS ->
     unconfigured[team] == 0;
#ifdef BUG
     set_gate(team, open);
#endif
     team++
  :: else -> break
  od;
  set_gate(0, open);
  set_gate(1, open)
}

/* Team::stop() of each team: the loop's flag first, then the gate. */
proctype Stopper() {
  is_stopped[0] = true;
  set_gate(0, leave);
  is_stopped[1] = true;
  set_gate(1, leave)
}

active proctype Quiescence() {
  timeout -> assert(left == THREADS)
}

init {
  atomic { unconfigured[0] = 2; unconfigured[1] = 1; run Starter(); run Stopper(); }
}
