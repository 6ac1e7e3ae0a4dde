// The rigid hosts "bullet" (of double precision where that is built), "bullet_float" and "bullet_double".
#pragma once

namespace cli {

void register_bullet();  // warns where a name is taken

}  // namespace cli
