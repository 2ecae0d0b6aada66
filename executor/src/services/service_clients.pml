/* Promela model of a response that waits for its client's reader (service_clients.hpp, replier.cpp).
 *
 * Two threads serve the service, as in a reentrant group: whoever takes the mark "ready" sends what waits
 * and may be sent, takes a request if there is one, and answers it. A request of a client comes; its
 * reader is connected at any time, by a thread of DDS, which says so to ServiceClients and marks the
 * service ready. The lock is the replier's; under it ServiceClients is asked.
 *
 * Shown: the response is sent, once, whenever the reader is connected, and nobody waits for that.
 *
 * -DBUG_FORGOTTEN: that readers changed is forgotten after looking, with what came meanwhile.
 * -DBUG_UNLOCKED: between asking and putting the response where it waits, the lock is not held.
 */
#define THREADS 2

bool request = false;
bool connected = false; /* what DDS says */
bool ready = false;
bool locked = false;

bool stale = true;
bool known = false;    /* the client is among those known, */
bool hearing = false;  /* and its reader was there when they were looked for */

bool waiting = false;
byte sent = 0;

inline lock() { atomic { !locked -> locked = true } }
inline unlock() { locked = false }

inline can_hear() {
  if
  :: !known || (!hearing && stale) ->
#ifndef BUG_FORGOTTEN
     stale = false;
#endif
     hearing = connected;
#ifdef BUG_FORGOTTEN
     stale = false;
#endif
     known = true
  :: else
  fi
}

active [THREADS] proctype Service() {
  bool mine;
end_sleep:
  do
  :: atomic { ready -> ready = false }
     lock();
     if
     :: waiting ->
        can_hear();
        if
        :: hearing -> waiting = false; sent++
        :: else
        fi
     :: else
     fi;
     unlock();
     atomic { mine = request; request = false }
     if
     :: mine ->
        lock();
        can_hear();
        if
        :: hearing -> unlock(); sent++
        :: else ->
#ifdef BUG_UNLOCKED
           unlock();
           lock();
#endif
           waiting = true;
           unlock()
        fi
     :: else
     fi
  od
}

active proctype Receiver() {
  request = true;
  ready = true
}

active proctype Discovery() {
  connected = true;
  stale = true;
  ready = true
}

active proctype Observer() {
  timeout -> assert(sent == 1)
}
