/* Promela model of arrival_log.hpp: a ring of the latest arrivals, one recorder, lock-free lookups.
 *
 * The delivering thread records the arrival of sample i at the address that its memory has, then puts
 * it into a queue of one sample, out of which it pushes the former one. The callback's thread takes a
 * sample and looks its arrival up by the address. Memory is used again as soon as its sample was taken
 * or pushed out. The ring has two places, so that entries are overwritten while they are read, and the
 * three addresses have two chains, so that entries of one are passed on the way to another's.
 *
 * Shown: a lookup finds the arrival of the very sample that was taken, or nothing; never another's,
 * never half of two.
 *
 * -DBUG: an entry is overwritten without being marked as incomplete first.
 */
#define SLOTS 2
#define ADDRESSES 3
#define SAMPLES 5
#define CHAINS 2
#define NONE 0

byte entry[SLOTS];   /* its number when complete */
byte sample[SLOTS];  /* an address, from 1 */
byte time[SLOTS];    /* the number of the sample stands for its arrival */
byte writer[SLOTS];
byte older[SLOTS];   /* in its chain */
byte newest[CHAINS]; /* where each begins */

bool used[ADDRESSES + 1];
byte queued = NONE; /* the address in the queue */
byte number = 0;    /* of the sample there */

proctype Recorder() {
  byte i = 1;
  byte address;
  byte slot;
  do
  :: i <= SAMPLES ->
     atomic { /* any memory that is free */
       if
       :: !used[1] -> address = 1
       :: !used[2] -> address = 2
       :: !used[3] -> address = 3
       fi;
       used[address] = true
     }
     slot = i % SLOTS;
#ifndef BUG
     entry[slot] = NONE;
#endif
     sample[slot] = address;
     time[slot] = i;
     writer[slot] = i;
     older[slot] = newest[address % CHAINS];
     entry[slot] = i;
     newest[address % CHAINS] = i;
     atomic { /* into the queue; what was there is pushed out */
       if
       :: queued != NONE -> used[queued] = false
       :: else
       fi;
       queued = address;
       number = i
     }
     i++
  :: else -> break
  od
}

proctype Taker() {
  byte address;
  byte mine;
  byte at;
  byte slot;
  byte found;
  byte found_time;
  byte found_writer;
  byte next;
end_take:
  do
  :: atomic { queued != NONE -> address = queued; mine = number; queued = NONE }
     at = newest[address % CHAINS];
     do
     :: at != NONE ->
        slot = at % SLOTS;
        found = sample[slot];
        found_time = time[slot];
        found_writer = writer[slot];
        next = older[slot];
        if
        :: entry[slot] != at -> break
        :: else ->
           if
           :: found == address ->
              assert(found_time == mine && found_writer == mine);
              break
           :: else -> at = next
           fi
        fi
     :: else -> break
     od;
     used[address] = false
  od
}

init {
  atomic { run Recorder(); run Taker(); }
}
