// SIGHUP: how a process is told to read its files again.
#pragma once

#include <functional>
#include <memory>

namespace cie {

// Keeps SIGHUP from ending the process: it waits until an OnHangup takes it. For the calling thread
// and those it creates, so call it before there are others. Programs that the process starts
// inherit it, unless they set their signal mask.
void hold_hangups();

// Calls a function for the SIGHUPs of this process, one that waited included, on an ordinary thread
// named "cie-hangup": it may load files and call Executor::reload_spec(). It must not throw.
// Needs hold_hangups() before. The destructor waits for a call in progress. Have one.
class OnHangup {
 public:
  // Throws std::system_error when the system gives no thread or descriptor.
  explicit OnHangup(std::function<void()> function);
  ~OnHangup();
  OnHangup(const OnHangup&) = delete;
  OnHangup& operator=(const OnHangup&) = delete;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace cie
