#include <cie/tracepoints/background_thread.hpp>

#include <cerrno>
#include <csignal>
#include <system_error>
#include <utility>

#include <pthread.h>
#include <sched.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace cie {
namespace {

constexpr int kNice = 10;

// An ordinary thread even if its creator is real-time: the attributes say so before it exists.
int create_thread(pthread_t* thread, std::size_t stack_bytes, void* (*enter)(void*),
                  void* argument) {
  pthread_attr_t attributes{};
  pthread_attr_init(&attributes);
  pthread_attr_setstacksize(&attributes, stack_bytes);
  const sched_param no_priority{};
  pthread_attr_setinheritsched(&attributes, PTHREAD_EXPLICIT_SCHED);
  pthread_attr_setschedpolicy(&attributes, SCHED_OTHER);
  pthread_attr_setschedparam(&attributes, &no_priority);
  int error = pthread_create(thread, &attributes, enter, argument);
  if (error == EPERM) {  // SCHED_IDLE without the right to leave it: stay there
    pthread_attr_setinheritsched(&attributes, PTHREAD_INHERIT_SCHED);
    error = pthread_create(thread, &attributes, enter, argument);
  }
  pthread_attr_destroy(&attributes);
  return error;
}

}  // namespace

BackgroundThread::BackgroundThread(std::string name, std::function<void()> function,
                                   std::size_t stack_bytes)
    : name_(std::move(name)), function_(std::move(function)) {
  sigset_t all;
  sigset_t previous;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &previous);  // the new thread inherits it
  const int error = create_thread(&thread_, stack_bytes, &BackgroundThread::enter, this);
  pthread_sigmask(SIG_SETMASK, &previous, nullptr);
  if (error != 0) {
    throw std::system_error(error, std::generic_category(),
                            "cannot create the thread \"" + name_ + "\"");
  }
}

BackgroundThread::~BackgroundThread() { pthread_join(thread_, nullptr); }

void* BackgroundThread::enter(void* self) noexcept {
  const auto& thread = *static_cast<BackgroundThread*>(self);
  const auto tid = static_cast<id_t>(syscall(SYS_gettid));
  if (getpriority(PRIO_PROCESS, tid) < kNice) {
    setpriority(PRIO_PROCESS, tid, kNice);
  }
  pthread_setname_np(pthread_self(),
                     thread.name_.c_str());  // from here on it is what its name says
  thread.function_();
  return nullptr;
}

}  // namespace cie
