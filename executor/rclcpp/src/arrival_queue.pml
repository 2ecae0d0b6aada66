/* Promela model of ArrivalQueue (inbox.hpp): how many announcements of a queue were overwritten.
 *
 * One thread announces, two of a reentrant group take, and one looks at the count, whenever that is. A queue keeps
 * the latest announcement.
 *
 * Shown: the count that is looked at is not above what it is in the end; and in the end every announcement was taken,
 * waits or was overwritten.
 *
 * -DBUG: a take does not look again after its claim, which another announcement may have overwritten before.
 */
#define DEPTH 1
#define ANNOUNCED 3
#define TAKES 2

byte stored = 0;
byte next = 0;
byte overwritten = 0;
byte taken = 0;
byte highest = 0;
byte ended = 0; /* of the four threads */

#define FIRST_KEPT(n, s) ((s) - (n) > DEPTH -> (s) - DEPTH : (n))
#define WAITING(n, s) ((n) < (s) -> FIRST_KEPT(n, s) - (n) : 0)

proctype Announcer() {
  do
  :: atomic { stored < ANNOUNCED -> stored++ }
  :: else -> break
  od;
  ended++
}

proctype Taker() {
  byte n;
  byte s;
  byte first;
  byte i;
  bool is_late;
take:
  atomic {
    if
    :: i == TAKES -> goto end
    :: else -> i++; n = next
    fi
  }
claim:
  atomic {
    s = stored;
    if
    :: n >= s -> goto take /* empty */
    :: else -> first = FIRST_KEPT(n, s)
    fi
  }
  atomic {
    if
    :: next == n -> next = first + 1
    :: else -> n = next; goto claim
    fi
  }
#ifndef BUG
  atomic { s = stored; is_late = (s - first > DEPTH) }
#endif
  atomic { overwritten = overwritten + first - n + is_late; n = first + 1 }
  if
  :: is_late -> goto claim
  :: else -> atomic { taken++; goto take }
  fi;
end:
  ended++
}

proctype Looker() {
  byte passed;
  byte n;
  byte s;
  do
  :: passed = overwritten;
     n = next;
     s = stored;
     if
     :: next == n -> break
     :: else
     fi
  od;
  highest = passed + WAITING(n, s);
  ended++
}

proctype Last() {
  byte count;
  ended == 4;
  count = overwritten + WAITING(next, stored);
  assert(highest <= count);
  assert(taken + count + (next < stored -> stored - FIRST_KEPT(next, stored) : 0) == ANNOUNCED)
}

init {
  atomic { run Announcer(); run Taker(); run Taker(); run Looker(); run Last(); }
}
