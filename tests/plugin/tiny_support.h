// What the plugin tests share: where the tiny plugins lie, contexts that see nothing but what a test shows
// them, one law in a batch.
#pragma once
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "deform/deform.h"
#include "support.h"

namespace tiny {

inline std::string plugin(const std::string &name) {
  return std::string(DEFORM_BINARY_DIR) + "/lib/tiny/" + name + ".so";
}

// An empty folder of this process (several programs of the suite run at once); gone when it ends.
inline std::string folder(const std::string &name) {
  static const struct Base {
    std::string path = test::scratch("plugin/" + std::to_string(getpid()));
    ~Base() {
      std::error_code ignored;
      std::filesystem::remove_all(path, ignored);
    }
  } base;
  const std::string dir = base.path + "/" + name;
  std::filesystem::remove_all(dir);
  std::filesystem::create_directories(dir);
  return dir;
}

struct Logged {
  int32_t level;
  std::string text;
};

// A context on `def` (or one that scans an empty folder) with its log kept.
struct Context {
  std::vector<Logged> log;
  dfm_context *c = nullptr;
  explicit Context(std::string plugin_dir = folder("none"), uint32_t threads = 1) {
    dfm_context_def def = dfm_context_def_default();
    def.plugin_dir = plugin_dir.c_str();
    def.threads = threads;
    def.user = this;
    def.log = [](void *user, int32_t level, const char *text) {
      static_cast<Context *>(user)->log.push_back({level, text});
    };
    EXPECT_EQ(dfm_context_create(&def, &c), DFM_OK) << dfm_last_error();
  }
  ~Context() { dfm_context_destroy(c); }
  Context(const Context &) = delete;
  Context &operator=(const Context &) = delete;

  std::vector<std::string> ids() const {
    std::vector<std::string> out;
    dfm_plugin_visit(
        c,
        [](void *user, const dfm_type *type, const char *) {
          static_cast<std::vector<std::string> *>(user)->push_back(type->id);
        },
        &out);
    return out;
  }
  std::string file_of(const std::string &id) const {
    std::pair<std::string, std::string> wanted{id, ""};
    dfm_plugin_visit(
        c,
        [](void *user, const dfm_type *type, const char *file) {
          auto &w = *static_cast<std::pair<std::string, std::string> *>(user);
          if (w.first == type->id) w.second = file;
        },
        &wanted);
    return wanted.second;
  }
  // The reason for the file whose path ends with `tail`; empty where it was not passed over.
  std::string reason(const std::string &tail) const {
    std::pair<std::string, std::string> wanted{tail, ""};
    dfm_plugin_visit_passed(
        c,
        [](void *user, const char *file, const char *why) {
          auto &w = *static_cast<std::pair<std::string, std::string> *>(user);
          const std::string f = file;
          if (f.size() >= w.first.size() &&
              f.compare(f.size() - w.first.size(), w.first.size(), w.first) == 0)
            w.second = why;
        },
        &wanted);
    return wanted.second;
  }
  bool logged(const std::string &part) const {
    for (const auto &l : log)
      if (l.text.find(part) != std::string::npos) return true;
    return false;
  }
  dfm_law open(const std::string &name) const {
    dfm_law law = 0;
    EXPECT_EQ(dfm_law_open(c, name.c_str(), &law), DFM_OK) << dfm_last_error();
    return law;
  }
};

// A law of the shelf at this width of vectors: a law chooses when its file is loaded, so a copy of the
// file is loaded.
inline dfm_law open_at_width(const Context &c, const std::string &name, const char *simd) {
  const std::string copy = folder("width") + "/" + name + "_" + simd + ".so";
  std::filesystem::copy_file(std::string(DEFORM_PLUGIN_DIR) + "/" + name + ".so", copy);
  setenv("DEFORM_SIMD", simd, 1);
  const dfm_law law = c.open(copy);
  unsetenv("DEFORM_SIMD");
  return law;
}

// A batch of n contacts with every column there is; stride and base are aligned as a plugin may expect.
struct Batch {
  uint32_t n, stride, nstate;
  std::unique_ptr<double[]> memory;
  std::vector<double> params;
  double *fn, *vt, *stop, *area, *dwell, *state, *ft, *state_out, *dv, *dn, *limit, *stored;
  std::vector<uint64_t> mode_memory;
  uint8_t *mode;
  dfm_friction_in in{};
  dfm_friction_out out{};

  explicit Batch(uint32_t count, std::vector<double> values = {}, uint32_t states = 0)
      : n(count),
        stride((count + 7) & ~7u),
        nstate(states),
        params(std::move(values)),
        mode_memory(stride / 8 + 8) {
    const size_t columns = 7 + nstate + 10 + nstate, total = columns * stride + 8;
    memory = std::make_unique<double[]>(total);
    void *base = memory.get();
    size_t space = total * sizeof(double);
    double *p = static_cast<double *>(std::align(64, columns * stride * sizeof(double), base, space));
    const auto take = [&](uint32_t width) { return std::exchange(p, p + size_t(width) * stride); };
    fn = take(1);
    vt = take(2);
    stop = take(2);
    area = take(1);
    dwell = take(1);
    state = take(nstate);
    ft = take(2);
    state_out = take(nstate);
    dv = take(4);
    dn = take(2);
    limit = take(1);
    stored = take(1);
    void *mode_base = mode_memory.data();
    space = mode_memory.size() * 8;
    mode = static_cast<uint8_t *>(std::align(64, stride, mode_base, space));
    for (uint32_t i = 0; i < stride; ++i) {
      fn[i] = 1;
      area[i] = 1;
      dwell[i] = 0;
    }
    in = {sizeof in, n, stride, 0, 1e-3, params.data(), nullptr, fn, vt, stop, area, dwell, state};
    out = {sizeof out, 0, ft, state_out, dv, dn, limit, mode, stored};
  }
};

}  // namespace tiny
