#include "plugin/registry.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstring>

#include "core/error.h"
#include "core/names.h"
#include "plugin/call.h"
#include "plugin/tables.h"

namespace dfm {
namespace {

// The size that every version of a struct has at least; smaller sizes are an error of the plugin.
constexpr uint32_t kTypeHead = offsetof(dfm_type, ops) + sizeof(void *);
constexpr uint32_t kParamHead = offsetof(dfm_param, names);
constexpr uint32_t kLawHead = offsetof(dfm_friction, eval) + sizeof(void *);
constexpr uint32_t kModelHead = offsetof(dfm_model, destroy) + sizeof(void *);
constexpr uint32_t kSolverHead = offsetof(dfm_solver, release) + sizeof(void *);
constexpr uint32_t kSlotsHead = offsetof(dfm_slots, slots) + sizeof(void *);
constexpr uint32_t kSlotHead = 16;
// Flags and claims that a host must know. None is defined yet; other unknown flags of a later header are
// ignored.
constexpr uint32_t kMustKnow = 0xffff0000u;
// A law that needs an input of a later ABI is refused.
constexpr uint32_t kKnownNeeds =
    DFM_NEED_FN | DFM_NEED_VT | DFM_NEED_FT_STOP | DFM_NEED_AREA | DFM_NEED_DWELL;
bool reverse_dns(const char *id) {
  bool dot = false;
  char last = '.';
  for (const char *c = id; *c; last = *c++) {
    if (*c == '.' ? last == '.' : !(std::isalnum(static_cast<unsigned char>(*c)) || *c == '_' || *c == '-'))
      return false;
    dot |= *c == '.';
  }
  return dot && last != '.';
}

void check_known(const std::string &id, const char *where, uint32_t bits) {
  if (bits & kMustKnow)
    bad_type(id, format("%s has bits that this library does not know (%#x); use a newer library, or set only "
                        "names of its deform/plugin.h",
                        where, bits & kMustKnow));
}

void check_head(const dfm_type &type) {
  const std::string id = type.id ? type.id : "";
  if (id.empty()) bad_type("", "it has no id; give one in reverse-DNS form such as \"org.example.mylaw\"");
  if (!reverse_dns(type.id)) bad_type(id, "its id is not in reverse-DNS form such as \"org.example.mylaw\"");
  const struct {
    const char *key, *text;
  } fields[] = {
      {"name", type.name}, {"version", type.version}, {"licence", type.licence}, {"source", type.source}};
  for (const auto &field : fields)
    if (!field.text || !*field.text) bad_type(id, format("its metadata lacks \"%s\"", field.key));
  if (type.kind < DFM_KIND_FRICTION || type.kind > DFM_KIND_SOLVER)
    bad_type(id, format("its kind %u is unknown to this library", type.kind));
  if (!type.ops) bad_type(id, "it has no operations (ops is NULL)");
}

void check_row(const std::string &id, const dfm_param &row, const std::vector<dfm_param> &before) {
  const std::string key = row.key ? row.key : "";
  if (key.empty()) bad_type(id, "a parameter row has no key");
  for (const auto &other : before)
    if (key == other.key) bad_type(id, format("parameter \"%s\" is listed twice in the table", key.c_str()));
  if (!row.label || !row.unit)
    bad_type(id, format("parameter \"%s\" lacks a label or a unit (\"1\" if dimensionless)", key.c_str()));
  if (!std::isfinite(row.min) || !std::isfinite(row.max) || !(row.min <= row.def && row.def <= row.max))
    bad_type(id, format("parameter \"%s\": the range [%g, %g] must be finite and hold the default %g",
                        key.c_str(), row.min, row.max, row.def));
  check_known(id, format("the flags of parameter \"%s\"", key.c_str()).c_str(), row.flags);
  if (row.width < 1 || row.width > 16)
    bad_type(id, format("parameter \"%s\": width %u is not in 1..16", key.c_str(), row.width));
  if ((row.flags & DFM_PARAM_LIST) && !(row.min <= 0 && 0 <= row.max))
    bad_type(
        id, format("parameter \"%s\" is a list, whose values that are not given read 0, which its range [%g, "
                   "%g] excludes",
                   key.c_str(), row.min, row.max));
  if (row.flags & DFM_PARAM_ENUM) {
    uint32_t n = 0;
    while (row.names && n < kLargestStruct && row.names[n]) ++n;
    if (n == 0 || row.min != 0 || row.max != n - 1)
      bad_type(id, format("parameter \"%s\": an enumeration of %u names needs the range [0, %g]", key.c_str(),
                          n, n - 1.0));
  }
}

void copy_rows(RegisteredType &out) {
  const dfm_type &type = out.type;
  const std::string id = type.id;
  if (type.nparam == 0) return;
  if (!type.params) bad_type(id, "nparam is not 0 but params is NULL");
  if (type.nparam > 4096 || type.param_size < kParamHead || type.param_size > kLargestStruct)
    bad_type(id, format("its parameter table has %u rows of %u bytes; at least %u bytes a row expected",
                        type.nparam, type.param_size, kParamHead));
  for (uint32_t i = 0; i < type.nparam; ++i) {
    const dfm_param row = row_at(type.params, type.param_size, i);
    check_row(id, row, out.rows);
    out.rows.push_back(row);
  }
  out.type.params = out.rows.data();
  out.type.param_size = sizeof(dfm_param);
}

// Copies the rows of the table in the size of this library.
template <class Ops>
void own_slots(RegisteredType &out, Ops &ops, bool law) {
  out.slots = copy_slots(out.type.id, ops.slots, ops.nslot, ops.slot_size, law);
  ops.slots = out.slots.empty() ? nullptr : out.slots.data();
  ops.slot_size = sizeof(dfm_slot);
}

void copy_ops(RegisteredType &out) {
  const std::string id = out.type.id;
  const void *ops = out.type.ops;
  if (out.type.kind == DFM_KIND_FRICTION) {
    copy_struct(out.friction, ops, kLawHead, id, "dfm_friction");
    if (!out.friction.eval) bad_type(id, "a law needs eval");
    if (!out.friction.prepare != !out.friction.release)
      bad_type(id, "set both prepare and release, or neither");
    if (out.friction.needs & ~kKnownNeeds)
      bad_type(id, format("it needs inputs that this library does not have (bits %#x of needs); use a newer "
                          "library, or only the DFM_NEED_* of its deform/plugin.h",
                          out.friction.needs & ~kKnownNeeds));
    check_known(id, "dfm_friction.flags", out.friction.flags);
    own_slots(out, out.friction, true);
    out.type.ops = &out.friction;
  } else if (out.type.kind == DFM_KIND_SOLVER) {
    copy_struct(out.solver, ops, kSolverHead, id, "dfm_solver");
    const dfm_solver &s = out.solver;
    if (!s.analyse || !s.factor || !s.solve || !s.release)
      bad_type(id, "a solver needs analyse, factor, solve and release");
    check_known(id, "dfm_solver.flags", s.flags);
    out.type.ops = &out.solver;
  } else {
    copy_struct(out.model, ops, kModelHead, id, "dfm_model");
    if (!out.model.create || !out.model.destroy) bad_type(id, "a model needs create and destroy");
    if (!out.model.add_forces && !out.model.extension)
      bad_type(id, "a model needs add_forces, or the extension \"dfm.stepper/1\"");
    if (out.model.cells == 0) bad_type(id, "a model must accept a kind of cell");
    check_known(id, "dfm_model.caps", out.model.caps);
    own_slots(out, out.model, false);
    out.type.ops = &out.model;
  }
}

}  // namespace

std::vector<dfm_slot> copy_slots(const std::string &id, const dfm_slot *slots, uint32_t n, uint32_t slot_size,
                                 bool law) {
  if (n > 4096 || (n && !slots)) bad_type(id, "its state slots are missing");
  const uint32_t row = slot_size ? slot_size : kSlotHead;
  if (row < kSlotHead || row > kLargestStruct)
    bad_type(id, format("its state slots have rows of %u bytes, at least %u expected; set slot_size to "
                        "sizeof(dfm_slot)",
                        row, kSlotHead));
  std::vector<dfm_slot> out(n);
  for (uint32_t i = 0; i < n; ++i) {
    const dfm_slot &s = out[i] = row_at(slots, row, i);
    const uint32_t width = s.kind == DFM_SLOT_TANGENT    ? 2
                           : s.kind == DFM_SLOT_VECTOR   ? 3
                           : s.kind == DFM_SLOT_ROTATION ? 4
                                                         : s.width;
    if (s.kind < DFM_SLOT_SCALAR || s.kind > DFM_SLOT_ROTATION || s.width == 0 || s.width > 4096 ||
        s.width != width)
      bad_type(id, format("state slot %u has kind %u and width %u, which do not agree", i, s.kind, s.width));
    if (law ? s.unit != DFM_PER_CONTACT : s.unit < DFM_PER_POINT || s.unit > DFM_PER_INSTANCE)
      bad_type(id,
               format("state slot %u has unit %u, which a %s cannot have", i, s.unit, law ? "law" : "model"));
  }
  return out;
}

std::optional<std::vector<dfm_slot>> copy_slots(const std::string &id, const dfm_slots *own, bool law) {
  const std::optional<dfm_slots> full = copy_table<dfm_slots>(own, kSlotsHead, id, "dfm_slots");
  if (!full) return std::nullopt;
  return copy_slots(id, full->slots, full->nslot, full->slot_size, law);
}

std::vector<dfm_slot> law_slots(const dfm_type &type, const dfm_host &host, const double *params) {
  const dfm_friction &law = law_of(type);
  if (!law.state) return {law.slots, law.slots + law.nslot};
  const dfm_slots *own = nullptr;
  call_plugin(host, type, "state", [&] { own = law.state(params); });
  if (!own) bad_type(type.id, "it does not report the state that its parameters need");
  return *copy_slots(type.id, own, true);
}

const char *kind_name(uint32_t kind) {
  return kind == DFM_KIND_FRICTION ? "law"
         : kind == DFM_KIND_MODEL  ? "model"
         : kind == DFM_KIND_SOLVER ? "solver"
                                   : "type";
}

std::string short_name(const dfm_type &type) {
  const char *dot = std::strrchr(type.id, '.');
  return dot ? dot + 1 : type.id;
}

std::vector<std::string> effects(const dfm_type &type) {
  std::vector<std::string> names;
  for (const char *const *e = type.effects; e && *e; ++e) names.push_back(*e);
  return names;
}

void Registry::add(const dfm_plugin &plugin, const std::string &file) {
  if (plugin.ntype == 0 || plugin.ntype > 4096 || !plugin.types)
    fail(DFM_E_UNSUPPORTED, "the plugin offers no types (ntype %u)", plugin.ntype);
  std::vector<std::unique_ptr<RegisteredType>> fresh;
  for (uint32_t i = 0; i < plugin.ntype; ++i) {
    if (!plugin.types[i]) fail(DFM_E_UNSUPPORTED, "entry %u of the plugin's list of types is NULL", i);
    auto entry = std::make_unique<RegisteredType>();
    copy_struct(entry->type, plugin.types[i], kTypeHead, format("#%u", i), "dfm_type");
    check_head(entry->type);
    copy_rows(*entry);
    copy_ops(*entry);
    entry->file = file;
    for (const auto *list : {&types_, &fresh})
      for (const auto &other : *list)
        if (std::strcmp(other->type.id, entry->type.id) == 0)
          fail(DFM_E_STATE,
               "id \"%s\" is taken by %s; give this plugin another id, or load it into a new context",
               entry->type.id, other->file.c_str());
    fresh.push_back(std::move(entry));
  }
  types_.reserve(types_.size() + fresh.size());
  for (auto &entry : fresh) types_.push_back(std::move(entry));
  std::sort(types_.begin(), types_.end(), [](const auto &a, const auto &b) {
    return a->type.kind != b->type.kind ? a->type.kind < b->type.kind
                                        : std::strcmp(a->type.id, b->type.id) < 0;
  });
}

const dfm_type *Registry::try_find(uint32_t kind, std::string_view name) const noexcept {
  const dfm_type *by_short_name = nullptr;
  for (const auto &entry : types_) {
    const dfm_type &type = entry->type;
    if (kind && type.kind != kind) continue;
    if (name == type.id) return &type;
    const char *dot = std::strrchr(type.id, '.');
    if (!by_short_name && dot && name == dot + 1) by_short_name = &type;
  }
  return by_short_name;
}

const dfm_type &Registry::find(uint32_t kind, std::string_view name) const {
  if (const dfm_type *type = try_find(kind, name)) return *type;
  const std::string wrong(name);
  std::vector<std::string> names, listed;
  for (const dfm_type *type : list(kind)) {
    names.push_back(short_name(*type));
    names.push_back(type->id);
    listed.push_back(short_name(*type));
  }
  const char *what = kind_name(kind);
  if (listed.empty())
    fail(DFM_E_UNSUPPORTED,
         "no %s \"%s\": no plugin with a %s is loaded; set DEFORM_PLUGIN_PATH or see \"deform plugin list\"",
         what, wrong.c_str(), what);
  fail(DFM_E_UNSUPPORTED, "no %s \"%s\" is loaded%s; loaded: %s", what, wrong.c_str(),
       did_you_mean(wrong, names).c_str(), join(listed).c_str());
}

std::vector<const dfm_type *> Registry::list(uint32_t kind) const {
  std::vector<const dfm_type *> out;
  for (const auto &entry : types_)
    if (kind == 0 || entry->type.kind == kind) out.push_back(&entry->type);
  return out;
}

const std::string &Registry::file_of(const dfm_type &type) const {
  for (const auto &entry : types_)
    if (&entry->type == &type) return entry->file;
  static const std::string none;
  return none;
}

}  // namespace dfm
