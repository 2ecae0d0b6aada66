/* Promela model of Admission (admission.hpp): rounds of spin_some(), and cancel() meanwhile.
 *
 * Two threads of callbacks try whenever somebody has them look; one thread spins two rounds, each of which lets in one
 * instance of either, ends early by its deadline or not, and closes; another closes at any time, as cancel() does, and
 * has cancelled before. An attempt finds something to run, or nothing.
 *
 * Shown: when close() has returned none begins that was not let in again; when a round is over and idle none runs; what
 * is let in is settled exactly once; no round waits for ever.
 *
 * -DBUG: a thread looks at the mode before it says that it is looking.
 */
#define THREADS 2
#define ROUNDS 2

mtype = { closed, round };

mtype mode = closed;
bool is_cancelled = false;
byte looking = 0;
byte running = 0;
byte current = 0; /* the round */
byte unsettled = 0;
byte left[THREADS];
byte round_of[THREADS];
bool has_to_look[THREADS];
bool cancel_returned = false;
bool has_ended = false;

inline settle(n) { unsettled = unsettled - (n) }

proctype Thread(byte me) {
  mtype seen;
  bool is_let_in;
end_idle:
  do
  :: has_to_look[me] ->
     has_to_look[me] = false;
     is_let_in = false;
#ifdef BUG
     seen = mode;
     looking++;
#else
     looking++;
     seen = mode;
#endif
     if
     :: seen == round ->
        atomic { /* under the mutex */
#ifdef BUG
          if
          :: round_of[me] == current && left[me] > 0 -> left[me]--; is_let_in = true
          :: else
          fi
#else
          if
          :: mode == round && round_of[me] == current && left[me] > 0 -> left[me]--; is_let_in = true
          :: else
          fi
#endif
        }
     :: else
     fi;
     if
     :: !is_let_in -> looking--
     :: is_let_in ->
        if
        :: /* the instance begins */
           atomic { assert(!cancel_returned); looking--; running++ }
           atomic {
             if
             :: round_of[me] == current -> settle(1)
             :: else -> assert(false) /* a round begins while none runs */
             fi
           }
           running--
        :: /* there is nothing */
           atomic {
             assert(round_of[me] == current);
             settle(1 + left[me]);
             left[me] = 0
           }
           looking--
        fi
     fi
  :: has_ended -> break
  od
}

inline close() {
  atomic { mode = closed }
  looking == 0
}

proctype Spinner() {
  byte i;
  byte rounds;
  bool has_deadline;
  if
  :: has_deadline = true
  :: has_deadline = false
  fi;
  do
  :: rounds < ROUNDS ->
     rounds++;
     atomic {
       if
       :: is_cancelled -> break
       :: else -> current++; unsettled = 0; mode = round
       fi
     }
     atomic {
       i = 0;
       do
       :: i < THREADS -> left[i] = 1; round_of[i] = current; unsettled++; i++
       :: else -> break
       od;
       has_to_look[0] = true;
       has_to_look[1] = true
     }
     if
     :: (unsettled == 0 || mode != round)
     :: has_deadline
     fi;
     close();
     (looking == 0 && running == 0);
     atomic { assert(unsettled <= left[0] + left[1]) }
  :: else -> break
  od;
  has_ended = true
}

proctype Canceller() {
  is_cancelled = true;
  close();
  cancel_returned = true
}

init {
  atomic { run Thread(0); run Thread(1); run Spinner(); run Canceller() }
}
