// Assertions of ODE end the process. Inside the worlds that the library makes itself (host "ode" of a scene)
// they end in an error of ours instead: ODE's handlers are replaced for the length of a call, and theirs
// throws, on the thread that is in the call. On every other thread, and outside such calls, the handlers that
// a host program has set are called as ever. What ODE was doing is left half done, so a world that was in it
// must neither be stepped nor destroyed any more.
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
