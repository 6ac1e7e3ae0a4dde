// V01 to V04: the file, its entry, and what it says of itself.
#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstring>
#include <limits>

#include "check/environment.h"
#include "check/groups.h"
#include "check/image.h"
#include "check/law.h"
#include "check/model.h"
#include "check/runner.h"
#include "check/watch.h"
#include "deform/plugin_draft.h"
#include "messages.h"
#include "slots.h"

namespace cli::check {

std::string exports_one_symbol(const Subject &subject) {
  std::vector<std::string> names = exported(subject.file);
  const auto entry = std::ranges::find(names, "dfm_plugin_entry");
  if (entry == names.end())
    broken("it exports no dfm_plugin_entry; define the entry of deform/plugin.h with DFM_EXPORT");
  names.erase(entry);
  if (!names.empty())
    broken(
        "it exports %zu symbol%s beside dfm_plugin_entry (%s%s); build it with deform_add_plugin, or link "
        "with -Wl,--version-script holding { global: dfm_plugin_entry; local: *; };",
        names.size(), names.size() == 1 ? "" : "s", names[0].c_str(), names.size() > 1 ? ", ..." : "");
  return "dfm_plugin_entry";
}

namespace {

// What the entry answers a host of that ABI.
const dfm_plugin *given_to(dfm_plugin_fn entry, uint32_t abi, uint32_t draft, uint32_t min) {
  Host host;
  const Kept kept("its entry");
  host.table().abi = abi;
  host.table().abi_draft = draft;
  host.table().abi_min = min;
  return entry(&host.table(), abi, min);
}

}  // namespace

std::string refuses_unknown_abi(const Subject &subject) {
  if (!subject.plugin) {
    const Kept kept("loading it");
    std::string why;
    void *image = load_image(subject.file, why);
    if (image && !entry_of(image)) skip("it has no dfm_plugin_entry (V01)");
    const Plugin plugin(subject.file);  // says why it does not load
    return "";
  }
  const dfm_plugin_fn entry = entry_of(subject.plugin->image());
  const struct {
    uint32_t abi, draft, min;
  } strangers[] = {
      {DFM_ABI + 1, 0, DFM_ABI + 1}, {DFM_ABI, DFM_ABI_DRAFT + 1, DFM_ABI}, {0, 1, 0}, {77, 77, 77}};
  for (const auto &stranger : strangers) {
    stage("the entry is called by a host of ABI %u draft %u", stranger.abi, stranger.draft);
    if (given_to(entry, stranger.abi, stranger.draft, stranger.min))
      broken(
          "its entry accepts a host of ABI %u draft %u, which it cannot know; return NULL unless "
          "DFM_ABI_OK(host)",
          stranger.abi, stranger.draft);
  }
  stage("the entry is called by a host of ABI %u that still speaks %u", DFM_ABI + 1, DFM_ABI);
  if (!given_to(entry, DFM_ABI + 1, 3, DFM_ABI))
    broken(
        "its entry refuses a host of ABI %u that still supports ABI %u; use DFM_ABI_OK(host), which reads "
        "abi_min",
        DFM_ABI + 1, DFM_ABI);
  return text("ABI %u", DFM_ABI);
}

// ---- V03 --------------------------------------------------------------------------------------------------

namespace {

const char *const kEffects[] = {"stiction",       "stribeck",     "viscous",       "presliding", "hysteresis",
                                "breakaway",      "volume",       "anisotropy",    "plasticity", "damping",
                                "large_rotation", "self_contact", "two_way_rigid", "cutting"};

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

void effects_known(const dfm_type &type) {
  const std::vector<std::string> known(std::begin(kEffects), std::end(kEffects));
  for (const char *const *e = type.effects; e && *e; ++e) {
    if (std::strchr(*e, '.') || std::ranges::find(known, *e) != known.end()) continue;
    broken(
        "it promises \"%s\", which is not the name of an effect%s; write an effect of your own as "
        "\"vendor.word\"",
        *e, did_you_mean(*e, known).c_str());
  }
}

void reserved_free(const char *what, uint32_t found) {
  if (found) broken("%s has %u in reserved; set it to 0", what, found);
}

void check_slots(const std::vector<dfm_slot> &slots, bool law) {
  for (uint32_t i = 0; i < slots.size(); ++i) {
    const dfm_slot &s = slots[i];
    const uint32_t width = s.kind == DFM_SLOT_TANGENT    ? 2
                           : s.kind == DFM_SLOT_VECTOR   ? 3
                           : s.kind == DFM_SLOT_ROTATION ? 4
                                                         : s.width;
    if (s.kind < DFM_SLOT_SCALAR || s.kind > DFM_SLOT_ROTATION || s.width == 0 || s.width != width)
      broken("state slot %u has kind %u and width %u, which do not agree; a tangent pair has width 2", i,
             s.kind, s.width);
    if (law ? s.unit != DFM_PER_CONTACT : s.unit < DFM_PER_POINT || s.unit > DFM_PER_INSTANCE)
      broken(
          "state slot %u has unit %u, which the host does not keep for it; a law's state is DFM_PER_CONTACT",
          i, s.unit);
    reserved_free(text("state slot %u", i).c_str(), s.reserved);
  }
}

// slots, nslot, slot_size and reserved of the operations of a law or a model
template <class Ops>
void check_slot_table(const Ops &ops, bool law) {
  if (ops.nslot && !ops.slots) broken("it has %u state slots but slots is NULL; set slots", ops.nslot);
  reserved_free(law ? "dfm_friction" : "dfm_model", ops.reserved);
  if (!is_slot_size(ops.slot_size))
    broken("slot_size is %u; set it to sizeof(dfm_slot), or to 0, which means the same in all of ABI 1",
           ops.slot_size);
  check_slots(slot_rows(ops.slots, ops.nslot, ops.slot_size), law);
}

// Checks the tables of dfm_friction.state and of DFM_EXT_SLOTS.
void check_own_slots(const dfm_slots *own, bool law, const char *from, const char *remedy) {
  const auto rows = slot_rows(own);
  if (!rows) broken("%s, so the host cannot keep its state; %s", from, remedy);
  dfm_slots full{};
  std::memcpy(&full, own, std::min<size_t>(own->size, sizeof full));
  reserved_free("its dfm_slots", full.reserved);
  check_slots(*rows, law);
}

void check_law(const dfm_type &type, const dfm_friction &law) {
  if (!law.prepare != !law.release) broken("it has only one of prepare and release; set both or neither");
  if (law.needs & ~31u) broken("needs has bits that this ABI does not know (%#x); use DFM_NEED_*", law.needs);
  if (law.flags & ~31u) broken("flags has bits that this ABI does not know (%#x); use DFM_FRIC_*", law.flags);
  if ((law.flags & DFM_FRIC_SET_VALUED) && !(law.needs & DFM_NEED_FT_STOP))
    broken("a set-valued law that does not need FT_STOP cannot hold at rest; add DFM_NEED_FT_STOP to needs");
  check_slot_table(law, true);
  if (!law.state) return;
  const Kept kept("state");
  const std::vector<double> params = default_params(type);
  check_own_slots(law.state(params.data()), true, "its function state names no slots for its defaults",
                  "return constant tables");
}

// Numbers that must agree, and functions that some parameters and claims require.
void check_model(const dfm_type &type, const dfm_model &model) {
  constexpr uint32_t kCells = DFM_CELL_POINT | DFM_CELL_EDGE | DFM_CELL_TRI | DFM_CELL_TET | DFM_CELL_HEX8 |
                              DFM_CELL_TET10 | DFM_CELL_HEX20 | DFM_CELL_HEX27;
  if (model.cells & ~kCells)
    broken("cells has bits that this ABI does not know (%#x); use DFM_CELL_*", model.cells & ~kCells);
  for (uint32_t i = 0; i < type.nparam && !model.set_params; ++i)
    if (type.params[i].flags & DFM_PARAM_RUNTIME)
      broken(
          "parameter \"%s\" may change during a run, but there is no set_params; set the function, or drop "
          "DFM_PARAM_RUNTIME",
          type.params[i].key ? type.params[i].key : "");

  constexpr uint32_t kKnown = DFM_CAP_ENERGY | DFM_CAP_STIFFNESS | DFM_CAP_DAMPING |
                              DFM_CAP_ROTATION_INVARIANT | DFM_CAP_PLAUSIBLE | DFM_CAP_CONSTANT_STIFFNESS |
                              DFM_CAP_INSIDE;
  if (model.caps & ~kKnown)
    broken("caps has bits that this ABI does not know (%#x); use DFM_CAP_*", model.caps & ~kKnown);
  if ((model.caps & DFM_CAP_CONSTANT_STIFFNESS) && !(model.caps & DFM_CAP_STIFFNESS))
    broken("it claims DFM_CAP_CONSTANT_STIFFNESS without DFM_CAP_STIFFNESS; claim both or none");
}

// A table of one function: the bytes after size and reserved.
bool lacks_its_function(const void *table) {
  void (*function)(void) = nullptr;
  std::memcpy(&function, static_cast<const char *>(table) + 2 * sizeof(uint32_t), sizeof function);
  return !function;
}

void check_effect_rows(const dfm_type &type, const dfm_effect_rows &table) {
  reserved_free("its dfm_effect_rows", table.reserved);
  if (table.n > 4096 || (table.n && !table.rows))
    broken("its dfm_effect_rows has nrow %u, but rows is NULL or too long; set rows", table.n);
  for (uint32_t i = 0; i < table.n; ++i) {
    dfm_effect_row row;
    std::memcpy(&row, reinterpret_cast<const char *>(table.rows) + size_t(i) * table.row_size, sizeof row);
    reserved_free(text("row %u of its dfm_effect_rows", i).c_str(), row.reserved);
    if (row.param >= type.nparam || type.params[row.param].width != 1)
      broken(
          "row %u of its dfm_effect_rows names parameter %u of %u, or one that is not one wide; name a row "
          "of dfm_type.params",
          i, row.param, type.nparam);
  }
}

// What an instance answers to extension(): tables that begin with their size, nothing where it has none.
void check_tables(const Subject &subject) {
  const dfm_model &model = model_of(subject);
  if (!model.extension || !takes_solids(subject)) return;
  const Solid solid = small_block();
  const Body body(subject, solid, defaults_of(subject), 4, Body::Refusal::is_reported);
  if (!body.made()) return;
  constexpr size_t one = 2 * sizeof(uint32_t) + sizeof(void *);
  const struct {
    const char *id, *name;
    size_t head;
    uint32_t row;  // least size of its rows, stored where others have `reserved`
    bool one;      // function, and nothing else
  } known[] = {
      {"dfm.stepper/1", "dfm_stepper", offsetof(dfm_stepper, commit) + sizeof(void *), 0, false},
      {DFM_EXT_LATE_POINTS, "dfm_late_points", offsetof(dfm_late_points, look) + sizeof(void *), 0, false},
      {DFM_EXT_CELL_ENERGY, "dfm_cell_energy", one, 0, true},
      {DFM_EXT_CELL_STRESS, "dfm_cell_stress", one, 0, true},
      {DFM_EXT_EFFECTS, "dfm_effects", one, 0, true},
      {DFM_EXT_IDLE, "dfm_idle", one, 0, true},
      {DFM_EXT_LIMITED, "dfm_limited", one, 0, true},
      {DFM_EXT_CAPS, "dfm_caps", one, 0, true},
      {DFM_EXT_FACTS, "dfm_facts", one, offsetof(dfm_fact, value) + sizeof(double), true},
      {DFM_EXT_EFFECT_ROWS, "dfm_effect_rows", offsetof(dfm_effect_rows, rows) + sizeof(void *),
       offsetof(dfm_effect_row, off) + sizeof(double), false}};
  for (const auto &k : known) {
    const void *table = body.extension(k.id);
    if (!table) continue;
    uint32_t head[2];
    std::memcpy(head, table, sizeof head);
    if (head[0] < k.head || head[0] > 65536)
      broken("the table of its extension \"%s\" has size %u; set it to sizeof(%s)", k.id, head[0], k.name);
    if (k.row && (head[1] < k.row || head[1] > 65536))
      broken("the rows of its extension \"%s\" have row_size %u; set it to their sizeof", k.id, head[1]);
    if (!k.row) reserved_free(text("the table of its extension \"%s\"", k.id).c_str(), head[1]);
    if (k.one && lacks_its_function(table))
      broken("the table of its extension \"%s\" has no function; set it, or return NULL for this id", k.id);
  }
  const auto *stepper = static_cast<const dfm_stepper *>(body.extension("dfm.stepper/1"));
  if (!stepper && !model.add_forces)
    broken("it has no add_forces and does not answer \"dfm.stepper/1\"; set one of them");
  const auto *single = static_cast<const dfm_f32 *>(body.extension(DFM_EXT_F32));
  if (single && !(single->prepare && single->add_forces))
    broken("dfm_f32 lacks prepare or add_forces; set both, or return NULL");
  const auto *by_part = static_cast<const dfm_part_forces *>(body.extension(DFM_EXT_PART_FORCES));
  if (by_part && !(by_part->parts && by_part->forces))
    broken("dfm_part_forces lacks parts or forces; set both, or return NULL");
  if (stepper && !(stepper->predict && stepper->respond && stepper->commit))
    broken("dfm_stepper lacks predict, respond or commit; set the three");
  if (stepper && stepper->size >= offsetof(dfm_stepper, fetch) + sizeof(void *) && stepper->fetch)
    broken("dfm_stepper.fetch is set, but it is reserved; leave it NULL");
  if (const auto *rows = static_cast<const dfm_effect_rows *>(body.extension(DFM_EXT_EFFECT_ROWS)); rows)
    check_effect_rows(*subject.type, *rows);
  if (const auto *own = static_cast<const dfm_slots *>(body.extension(DFM_EXT_SLOTS)); own)
    check_own_slots(own, false, "the table of its extension \"" DFM_EXT_SLOTS "\" cannot be read",
                    "set size to sizeof(dfm_slots) and slot_size to sizeof(dfm_slot)");
  if (body.extension("dfm.unheard-of/1"))
    broken(
        "extension returns a table for an id that it cannot know; return NULL for every id except those that "
        "it compares");
}

bool is_text(const char *text) {
  constexpr size_t kLongest = 4096;
  size_t n = 0;
  for (; n < kLongest && text[n]; ++n)
    if (std::iscntrl(static_cast<unsigned char>(text[n])) &&
        !std::isspace(static_cast<unsigned char>(text[n])))
      return false;
  return n < kLongest;
}

// What the members of the row point to is text. It is not where nparam or param_size is wrong.
bool readable(const dfm_param &row) {
  bool all = false;
  const std::string fault = Fenced::guard([&] {
    for (const char *text : {row.key, row.label, row.unit})
      if (text && !is_text(text)) return;
    if (row.flags & DFM_PARAM_ENUM)
      for (uint32_t k = 0; row.names && k < 4096 && row.names[k]; ++k)
        if (!is_text(row.names[k])) return;
    all = true;
  });
  return all && fault.empty();
}

std::string unreadable_row(const dfm_type &type) {
  for (uint32_t i = 0; i < type.nparam; ++i) {
    const bool is_row = readable(type.params[i]);
    if (is_row && type.params[i].key && *type.params[i].key) continue;
    return text("row %u of nparam %u of its parameter table %s; %s", i + 1, type.nparam,
                is_row ? "has no key" : "holds no readable key, label and unit", kSizeOfTable);
  }
  return "";
}

}  // namespace

std::string unusable(const dfm_type &type) {
  if (const std::string row = unreadable_row(type); !row.empty()) return row;
  if (type.kind == DFM_KIND_FRICTION) {
    return static_cast<const dfm_friction *>(type.ops)->eval
               ? ""
               : "a law without eval cannot be evaluated; set dfm_friction.eval";
  }
  if (type.kind == DFM_KIND_SOLVER) {
    const auto &solver = *static_cast<const dfm_solver *>(type.ops);
    return solver.analyse && solver.factor && solver.solve && solver.release
               ? ""
               : "a solver without analyse, factor, solve and release cannot be used; set all four";
  }
  const auto &model = *static_cast<const dfm_model *>(type.ops);
  if (!model.create || !model.destroy) return "a model without create and destroy cannot be made; set both";
  if (!model.add_forces && !model.extension)
    return "a model without add_forces and without the extension \"dfm.stepper/1\" cannot move; give one";
  if (model.add_forces && !model.bound) return "it adds forces but dfm_model.bound is NULL; set the function";
  const struct {
    uint32_t bit;
    bool there;
    const char *cap, *function;
  } claims[] = {
      {DFM_CAP_ENERGY, model.energy != nullptr, "DFM_CAP_ENERGY", "energy"},
      {DFM_CAP_STIFFNESS, model.pattern && model.stiffness, "DFM_CAP_STIFFNESS", "pattern and stiffness"}};
  for (const auto &c : claims)
    if ((model.caps & c.bit) && !c.there)
      return text("it claims %s without %s; set the function, or drop the claim", c.cap, c.function);
  return "";
}

std::string metadata_complete(const Subject &subject) {
  const dfm_type &type = *subject.type;
  if (const std::string why = unusable(type); !why.empty()) broken("%s", why.c_str());
  const struct {
    const char *key, *text, *remedy;
  } fields[] = {{"name", type.name, "the name that lists show"},
                {"version", type.version, "results are cited with it"},
                {"licence", type.licence, "without one it may not be redistributed"},
                {"source", type.source, "the paper and equation that it implements"}};
  if (!type.id || !reverse_dns(type.id))
    broken("its id \"%s\" is not in reverse-DNS form; use a name like \"org.example.mylaw\"",
           name_of(type, subject.index).c_str());
  for (const auto &field : fields)
    if (!field.text || !*field.text)
      broken("its metadata lacks \"%s\" (%s); fill it in", field.key, field.remedy);
  const auto &types = subject.plugin->types();
  for (uint32_t i = 0; i < types.size(); ++i)
    if (i != subject.index && types[i]->id && std::strcmp(types[i]->id, type.id) == 0)
      broken("two types of this file have the id \"%s\"; give each its own id", type.id);
  effects_known(type);
  if (type.kind == DFM_KIND_FRICTION) {
    check_law(type, law_of(subject));
  } else if (type.kind == DFM_KIND_SOLVER) {
    const auto &solver = *static_cast<const dfm_solver *>(type.ops);
    if (solver.flags & ~uint32_t(DFM_SOLVER_DIRECT))
      broken("flags has bits that this ABI does not know (%#x); use DFM_SOLVER_*",
             solver.flags & ~uint32_t(DFM_SOLVER_DIRECT));
  } else {
    const auto &model = *static_cast<const dfm_model *>(type.ops);
    if (model.cells == 0)
      broken("a model that accepts no kind of cell fits no mesh; set cells to DFM_CELL_*");
    check_slot_table(model, false);
    check_model(type, model);
    check_tables(subject);
  }
  return text("%s %s, %s", type.id, type.version, type.licence);
}

// ---- V04 --------------------------------------------------------------------------------------------------

namespace {

void row_sane(const dfm_type &type, uint32_t i) {
  const dfm_param &row = type.params[i];
  const std::string key = row.key;
  const char *k = key.c_str();
  for (uint32_t j = 0; j < i; ++j)
    if (key == type.params[j].key) broken("parameter \"%s\" is listed twice; rename one", k);
  if (!row.label || !*row.label || !row.unit || !*row.unit)
    broken("parameter \"%s\" lacks a label or a unit; the unit of a pure number is \"1\"", k);
  if (!std::isfinite(row.min) || !std::isfinite(row.max) || !(row.min <= row.def && row.def <= row.max))
    broken("parameter \"%s\": the range [%g, %g] must be finite and contain the default %g; correct it", k,
           row.min, row.max, row.def);
  if (row.width < 1 || row.width > 16)
    broken("parameter \"%s\" has width %u; 1 to 16 doubles are packed", k, row.width);
  if ((row.flags & (DFM_PARAM_INTEGER | DFM_PARAM_ENUM)) && row.def != std::floor(row.def))
    broken("parameter \"%s\" is a whole number but its default is %g; round it", k, row.def);
  if ((row.flags & DFM_PARAM_LOG_SCALE) && !(row.min > 0))
    broken("parameter \"%s\" has a logarithmic scale that begins at %g; let min be above 0", k, row.min);
  if (row.flags & ~127u)
    broken("parameter \"%s\" has flags that this ABI does not know (%#x); use DFM_PARAM_*", k, row.flags);
  if ((row.flags & DFM_PARAM_LIST) && !(row.min <= 0 && 0 <= row.max))
    broken(
        "parameter \"%s\" is a list, where missing values are 0, but its range [%g, %g] excludes 0; widen it",
        k, row.min, row.max);
  if (row.flags & DFM_PARAM_ENUM) {
    uint32_t n = 0;
    while (row.names && n < 4096 && row.names[n]) ++n;
    if (n == 0 || row.min != 0 || row.max != n - 1)
      broken("parameter \"%s\" has %u words; set its range to [0, %g]", k, n, n - 1.0);
  }
}

// What the law's check does with a small buffer: it must end the sentence inside.
void runs_check(const dfm_friction &law, const std::vector<double> &params) {
  char room[96];
  for (size_t cap : {size_t(16), size_t(1), size_t(0)}) {
    std::memset(room, 0x5a, sizeof room);
    room[16] = 0x5a;
    const Kept kept("check");
    law.check(params.data(), room, cap);
    for (size_t i = cap; i < sizeof room; ++i)
      if (room[i] != 0x5a)
        broken("check writes %zu bytes past the end of its buffer of %zu bytes; use snprintf(why, cap, ...)",
               i - cap + 1, cap);
  }
}

// Through the library, as a scene would: a value beside the range must not reach the law. What the library
// refuses to load is V03's to say.
void library_refuses(const Subject &subject) {
  const BareContext context = bare_context();
  dfm_law law = 0;
  if (!context || dfm_plugin_load(context.get(), subject.file.c_str()) < 0 ||
      dfm_law_open(context.get(), subject.type->id, &law) < 0)
    return;
  if (dfm_law_pack(law, nullptr, 0, nullptr, nullptr) < 0)
    broken("the library refuses its defaults (%s); choose defaults that check accepts", dfm_last_error());
  for (uint32_t i = 0; i < subject.type->nparam; ++i) {
    const dfm_param &row = subject.type->params[i];
    for (const double outside : {std::nextafter(row.max, HUGE_VAL), std::nextafter(row.min, -HUGE_VAL),
                                 std::numeric_limits<double>::quiet_NaN()}) {
      const std::vector<double> values(row.width, outside);
      const dfm_param_value value{row.key, values.data(), row.width};
      const dfm_params params{sizeof params, 1, &value};
      if (dfm_law_pack(law, &params, 0, nullptr, nullptr) == DFM_OK)
        broken(
            "parameter \"%s\" = %.17g is accepted although it lies outside [%g, %g]; correct the range, or "
            "refuse the value",
            row.key, outside, row.min, row.max);
    }
  }
}

}  // namespace

std::string parameters_sane(const Subject &subject) {
  const dfm_type &type = *subject.type;
  for (uint32_t i = 0; i < type.nparam; ++i) row_sane(type, i);
  if (type.kind != DFM_KIND_FRICTION) return text("%u parameters", type.nparam);
  const dfm_friction &law = law_of(subject);
  const std::vector<double> defaults = default_params(type);
  stage("check is asked about the defaults");
  if (const std::string why = refusal(law, defaults); !why.empty())
    broken("its own check refuses the defaults (%s); choose defaults that check accepts", why.c_str());
  if (law.check) runs_check(law, defaults);
  library_refuses(subject);
  // The ends of every range, one at a time: check refuses them with a sentence, or eval answers them.
  uint32_t refused = 0;
  size_t at = 0;
  for (uint32_t i = 0; i < type.nparam; at += type.params[i].width, ++i)
    for (const double end : {type.params[i].min, type.params[i].max}) {
      std::vector<double> params = defaults;
      std::fill_n(params.begin() + static_cast<std::ptrdiff_t>(at), type.params[i].width, end);
      stage("parameter \"%s\" at %g", type.params[i].key, end);
      if (const std::string why = refusal(law, params); !why.empty()) {
        if (why == "(no reason)")
          broken("check refuses \"%s\" = %g without a reason; write a message into why", type.params[i].key,
                 end);
        ++refused;
        continue;
      }
      const Law made(subject, params);
      Lanes b(made, 8);
      for (uint32_t k = 0; k < b.n; ++k) {
        if (made.needs(DFM_NEED_FN)) b.fn[k] = std::pow(10.0, k % 4);
        b.slip(k, k < 4 ? 0.0 : 1e-3, 0);
      }
      b.must(1e-3);
      b.commit();
      b.must(1e-3);
      for (uint32_t k = 0; k < b.n; ++k)
        if (!std::isfinite(b.ft(k)))
          broken(
              "with \"%s\" = %g, the end of its range, the force at %g N and %g m/s is not finite; narrow "
              "the range, or let check refuse it",
              type.params[i].key, end, b.fn[k], k < 4 ? 0.0 : 1e-3);
    }
  return text("%u parameters, %u ends of ranges refused by check", type.nparam, refused);
}

}  // namespace cli::check
