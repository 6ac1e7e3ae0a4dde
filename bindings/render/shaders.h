#pragma once

namespace render {
extern const char *const kVertexShader, *const kFragmentShader, *const kDepthVertexShader,
                                                                    *const kDepthFragmentShader,
                                                                        *const kBackgroundVertexShader,
                                                                            *const kBackgroundFragmentShader;
// Directions of the sky whose shadows are traced. The fragment shader repeats the number as kSkyText; with
// fewer, which the renderer writes there, it also leaves out what costs software most.
inline constexpr int kSkyLights = 48;
inline constexpr const char *kSkyText = "const int SKY = 48;", *kKindText = "const int kind = 0;";
enum class Kind : int { lit = 0, floor = 1, plain = 2, through = 3 };
}  // namespace render
