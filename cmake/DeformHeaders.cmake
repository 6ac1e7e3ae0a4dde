# Libraries of headers alone, for a build by a compiler of another system: seen through a folder that holds
# nothing else, since the system's own headers lie beside them.
function(deform_headers_of target header)
  cmake_path(GET header PARENT_PATH folder)
  find_path(place ${header} PATHS /usr/include /usr/include/eigen3 NO_DEFAULT_PATH NO_CMAKE_FIND_ROOT_PATH
    NO_CACHE REQUIRED)
  set(seen ${PROJECT_BINARY_DIR}/headers/${folder})
  cmake_path(GET seen PARENT_PATH above)
  file(MAKE_DIRECTORY ${above})
  file(CREATE_LINK ${place}/${folder} ${seen} SYMBOLIC)
  if(NOT TARGET ${target})
    add_library(${target} INTERFACE IMPORTED GLOBAL)
    target_include_directories(${target} INTERFACE ${PROJECT_BINARY_DIR}/headers)
  endif()
endfunction()
deform_headers_of(Eigen3::Eigen Eigen/Core)
deform_headers_of(nlohmann_json::nlohmann_json nlohmann/json.hpp)
deform_headers_of(CLI11::CLI11 CLI/CLI.hpp)
deform_headers_of(deform_lanes simde/x86/sse2.h)
