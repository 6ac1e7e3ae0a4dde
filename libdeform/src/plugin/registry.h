// The types of all loaded plugins. They are copied into structs of this library's size with stable addresses:
// a plugin built against an older header has shorter structs, whose missing tail is set to zero, so that the
// rest of the library need not distinguish versions.
#pragma once
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "deform/plugin.h"

namespace dfm {

struct RegisteredType {
  dfm_type type{};
  dfm_friction friction{};
  dfm_model model{};
  dfm_solver solver{};
  std::vector<dfm_param> rows;
  std::vector<dfm_slot> slots;
  std::string file;  // "static:NAME" for a registered one
};

struct PassedFile { std::string file, reason; };

class Registry {
 public:
  Registry() = default;
  Registry(const Registry &) = delete;
  Registry &operator=(const Registry &) = delete;

  // Adds all types of a plugin, or none: throws Error with the reason (metadata, parameter table, operations,
  // duplicate id).
  void add(const dfm_plugin &plugin, const std::string &file);

  // Finds by full id, else by short name (the part after the last dot of the id). Throws DFM_E_UNSUPPORTED,
  // which lists the loaded ones and suggests the nearest.
  const dfm_type &find(uint32_t kind, std::string_view name) const;
  const dfm_type *try_find(uint32_t kind, std::string_view name) const noexcept;
  std::vector<const dfm_type *> list(uint32_t kind = 0) const;  // by kind and id; 0: all
  const std::string &file_of(const dfm_type &type) const;

  void pass_over(std::string file, std::string reason) {
    passed_.push_back({std::move(file), std::move(reason)});
  }
  const std::vector<PassedFile> &passed() const { return passed_; }

 private:
  std::vector<std::unique_ptr<RegisteredType>> types_;
  std::vector<PassedFile> passed_;
};

const char *kind_name(uint32_t kind);  // "law", "model", "solver"
std::string short_name(const dfm_type &type);
std::vector<std::string> effects(const dfm_type &type);
// The state slots of a law with these parameters; throws Error if they are invalid.
std::vector<dfm_slot> law_slots(const dfm_type &type, const dfm_host &host, const double *params);
inline const dfm_friction &law_of(const dfm_type &type) {
  return *static_cast<const dfm_friction *>(type.ops);
}
inline const dfm_model &model_of(const dfm_type &type) { return *static_cast<const dfm_model *>(type.ops); }
inline const dfm_solver &solver_of(const dfm_type &type) {
  return *static_cast<const dfm_solver *>(type.ops);
}

}  // namespace dfm
