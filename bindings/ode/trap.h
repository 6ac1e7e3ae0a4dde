// Assertions of ODE end the process. Inside the worlds that the library makes itself (host "ode" of a scene)
// they become an error of the library instead: ODE's handlers are replaced during a call, and the new ones
// throw on the thread of the call. On other threads, and outside such calls, the handlers of the host program
// are called as before. ODE's work is left unfinished, so its world must neither be stepped nor destroyed
// after that.
#pragma once
#include <string>

namespace dfm_ode_detail {

struct Assertion { std::string message; };  // thrown through ODE's frames

class Trap {
 public:
  Trap();
  ~Trap();
  Trap(const Trap &) = delete;
  Trap &operator=(const Trap &) = delete;
};

}  // namespace dfm_ode_detail
