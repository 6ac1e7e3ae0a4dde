#include "gl.h"

namespace render {

bool Gl::load(const Context &context, std::string *missing) {
#define X(name, type)                                                     \
  name = reinterpret_cast<PFNGL##type##PROC>(context.symbol("gl" #name)); \
  if (!name) {                                                            \
    *missing = "gl" #name;                                                \
    return false;                                                         \
  }
  RENDER_GL_FUNCTIONS(X)
#undef X
  return true;
}

}  // namespace render
