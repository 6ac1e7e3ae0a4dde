// A GL context without a window. The drawing code sees this and a table of functions; it does not know
// which library provides them.
#pragma once
#include <memory>
#include <string>

#include "render.h"

namespace render {

class Context {
 public:
  virtual ~Context() = default;
  virtual bool make_current() = 0;
  virtual void release() = 0;
  virtual Symbol symbol(const char *name) const = 0;
  virtual const char *name() const = 0;
};

// Null with one sentence where the library or its context is not to be had.
std::unique_ptr<Context> create_egl(std::string *why_not);
std::unique_ptr<Context> create_osmesa(std::string *why_not);

// dlopen of the first name that works; `variable` names the environment variable that replaces the names. The
// handle is never closed: Mesa's LLVM does not survive being unloaded.
void *open_library(const char *variable, std::initializer_list<const char *> names);

}  // namespace render
