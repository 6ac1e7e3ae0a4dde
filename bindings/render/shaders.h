#pragma once

namespace render {
extern const char *const kVertexShader, *const kFragmentShader, *const kDepthVertexShader,
                                                                    *const kDepthFragmentShader,
                                                                        *const kBackgroundVertexShader,
                                                                            *const kBackgroundFragmentShader;
// directions of the sky whose shadows are traced; the fragment shader repeats the number
inline constexpr int kSkyLights = 48;
enum class Kind : int { lit = 0, floor = 1, plain = 2 };
}  // namespace render
