// deform plugin list | info ID | check FILE
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "arguments.h"
#include "become.h"
#include "cli.h"
#include "json_text.h"
#include "messages.h"
#include "system.h"

namespace cli {
namespace {

struct Type {
  const dfm_type *type;
  std::string file;
};
struct Passed { std::string file, reason; };
struct Found {
  std::vector<Type> types;
  std::vector<Passed> passed;
};

using Context = std::unique_ptr<dfm_context, decltype(&dfm_context_destroy)>;

Found look(dfm_context *context) {
  Found found;
  dfm_plugin_visit(
      context,
      [](void *user, const dfm_type *type, const char *file) {
        static_cast<Found *>(user)->types.push_back({type, file});
      },
      &found);
  dfm_plugin_visit_passed(
      context,
      [](void *user, const char *file, const char *reason) {
        static_cast<Found *>(user)->passed.push_back({file, reason});
      },
      &found);
  return found;
}

std::vector<std::string> effects(const dfm_type &type) {
  std::vector<std::string> out;
  for (const char *const *e = type.effects; e && *e; ++e) out.push_back(*e);
  return out;
}

std::string joined(const std::vector<std::string> &words) {
  std::string out;
  for (const auto &w : words) out += (out.empty() ? "" : " ") + w;
  return out.empty() ? "none" : out;
}

JsonObject json_head(const Type &t) {
  JsonObject o;
  o.add("kind", quoted(kind_name(t.type->kind)), "id", quoted(t.type->id), "name", quoted(t.type->name),
        "version", quoted(t.type->version), "file", quoted(t.file), "effects", json_words(effects(*t.type)));
  return o;
}

int list(const Globals &globals, const std::vector<std::string> &directories) {
  const Context context(make_context(globals), dfm_context_destroy);
  for (const auto &directory : directories)
    if (dfm_plugin_scan(context.get(), directory.c_str(), nullptr) < 0) return fail(dfm_last_error());
  const Found found = look(context.get());
  if (globals.json) {
    std::vector<std::string> types, passed;
    for (const Type &t : found.types) types.push_back(json_head(t).text());
    for (const Passed &p : found.passed)
      passed.push_back(json_object("file", quoted(p.file), "reason", quoted(p.reason)));
    std::fputs(indented(json_object("types", json_array(types), "passed", json_array(passed))).c_str(),
               stdout);
    return kDone;
  }
  for (const Type &t : found.types)
    std::printf("%-6s %-28s %-8s %s\n       effects: %s\n       %s\n", kind_name(t.type->kind), t.type->id,
                t.type->version, t.type->name, joined(effects(*t.type)).c_str(), shown(t.file).c_str());
  if (found.types.empty())
    std::printf("no plugin is loaded; set DEFORM_PLUGIN_PATH, or name directories with --dir\n");
  if (!found.passed.empty()) std::printf("\npassed over:\n");
  for (const Passed &p : found.passed)
    std::printf("  %s\n    %s\n", shown(p.file).c_str(), shown(p.reason).c_str());
  return kDone;
}

// By full id or short name; several kinds may share a short name, then all are shown.
std::vector<Type> matching(const Found &found, const std::string &id) {
  std::vector<Type> exact, by_short_name;
  for (const Type &t : found.types) {
    const char *dot = std::strrchr(t.type->id, '.');
    if (id == t.type->id) exact.push_back(t);
    if (dot && id == dot + 1) by_short_name.push_back(t);
  }
  return exact.empty() ? by_short_name : exact;
}

std::vector<std::string> names_of(const dfm_param &row) {
  std::vector<std::string> out;
  for (const char *const *n = row.names; n && *n; ++n) out.push_back(*n);
  return out;
}

// What a model or a solver says of itself, in words; none of a law.
std::vector<std::string> capabilities(const dfm_type &type) {
  std::vector<std::string> out;
  if (type.kind == DFM_KIND_SOLVER && static_cast<const dfm_solver *>(type.ops)->flags & DFM_SOLVER_DIRECT)
    out.push_back("direct");
  if (type.kind != DFM_KIND_MODEL) return out;
  const uint32_t caps = static_cast<const dfm_model *>(type.ops)->caps;
  const struct {
    uint32_t bit;
    const char *name;
  } names[] = {{DFM_CAP_ENERGY, "energy"},
               {DFM_CAP_DAMPING, "damping"},
               {DFM_CAP_ROTATION_INVARIANT, "rotation_invariant"},
               {DFM_CAP_PLAUSIBLE, "plausible"},
               {DFM_CAP_STIFFNESS, "stiffness"},
               {DFM_CAP_CONSTANT_STIFFNESS, "constant_stiffness"},
               {DFM_CAP_INSIDE, "inside"}};
  for (const auto &cap : names)
    if (caps & cap.bit) out.push_back(cap.name);
  return out;
}

void print_info(const Type &t) {
  const dfm_type &type = *t.type;
  std::printf(
      "%s %s, version %s\n  name     %s\n  licence  %s\n  source   %s\n  file     %s\n  effects  %s\n",
      kind_name(type.kind), type.id, type.version, type.name, type.licence, type.source,
      shown(t.file).c_str(), joined(effects(type)).c_str());
  if (type.kind != DFM_KIND_FRICTION) std::printf("  can      %s\n", joined(capabilities(type)).c_str());
  if (type.nparam)
    std::printf("\n  %-18s %-10s %-16s %-10s %s\n", "parameter", "default", "range", "unit", "meaning");
  for (uint32_t i = 0; i < type.nparam; ++i) {
    const dfm_param &row = type.params[i];
    const std::string value = formatted(row.flags & DFM_PARAM_AUTO ? "auto (%g)" : "%g", row.def);
    const std::string names = row.names ? joined(names_of(row)) : "",
                      range = names.empty() ? formatted("%g .. %g", row.min, row.max) : names;
    std::printf("  %-18s %-10s %-16s %-10s %s%s%s%s\n", row.key, value.c_str(), range.c_str(), row.unit,
                row.label,
                row.width > 1 ? (std::string(row.flags & DFM_PARAM_LIST ? " (up to " : " (") +
                                 std::to_string(row.width) + " values)")
                                    .c_str()
                              : "",
                row.flags & DFM_PARAM_RUNTIME ? ", may change in a run" : "",
                row.flags & DFM_PARAM_PER_CELL ? ", may vary by cell" : "");
  }
}

std::string json_info(const Type &t) {
  std::vector<std::string> rows;
  for (uint32_t i = 0; i < t.type->nparam; ++i) {
    const dfm_param &row = t.type->params[i];
    const auto flag = [&](uint32_t bit) { return (row.flags & bit) != 0; };
    JsonObject o;
    o.add("key", quoted(row.key), "label", quoted(row.label), "unit", quoted(row.unit), "min", row.min, "max",
          row.max, "default", row.def, "width", row.width, "integer", flag(DFM_PARAM_INTEGER), "runtime",
          flag(DFM_PARAM_RUNTIME), "per_cell", flag(DFM_PARAM_PER_CELL), "auto", flag(DFM_PARAM_AUTO));
    if (row.names) o.add("names", json_words(names_of(row)));
    rows.push_back(o.text());
  }
  JsonObject head = json_head(t);
  if (t.type->kind != DFM_KIND_FRICTION) head.add("capabilities", json_words(capabilities(*t.type)));
  return head
      .add("licence", quoted(t.type->licence), "source", quoted(t.type->source), "params", json_array(rows))
      .text();
}

int info(const Globals &globals, const std::string &id) {
  const Context context(make_context(globals), dfm_context_destroy);
  std::vector<Type> types;
  if (id.find('/') != std::string::npos) {
    if (dfm_plugin_load(context.get(), id.c_str()) < 0) return fail(dfm_last_error());
    std::error_code absent;
    for (const Type &t : look(context.get()).types)
      if (std::filesystem::equivalent(path_of(t.file), path_of(id), absent)) types.push_back(t);
  } else {
    types = matching(look(context.get()), id);
  }
  if (types.empty()) {
    std::vector<std::string> ids, names;
    for (const Type &t : look(context.get()).types) {
      ids.push_back(t.type->id);
      names.push_back(t.type->id);
      if (const char *dot = std::strrchr(t.type->id, '.')) names.push_back(dot + 1);
    }
    return fail("no plugin \"" + id + "\" is loaded" + did_you_mean(id, names) + "; loaded: " + joined(ids));
  }
  if (globals.json) {
    std::vector<std::string> all;
    for (const Type &t : types) all.push_back(json_info(t));
    std::fputs(indented(all.size() == 1 ? all[0] : json_array(all)).c_str(), stdout);
    return kDone;
  }
  for (const Type &t : types) print_info(t);
  return kDone;
}

}  // namespace

void add_plugin(Command app, Globals &globals, int *exit_code) {
  Command plugin = app.command("plugin", "what plugins were found, what they offer");
  plugin.needs_subcommand();

  Command list_command =
      plugin.command("list", "types found, with their files; files skipped, with the reason");
  auto directories = std::make_shared<std::vector<std::string>>();
  list_command.option("--dir", *directories, "also scan this directory").type_name("DIR");
  list_command.calls([=, &globals] { *exit_code = list(globals, *directories); });

  Command info_command = plugin.command("info", "metadata, effects and parameters of a type");
  auto id = std::make_shared<std::string>();
  info_command.option("ID", *id, "short name, full id, or path of a plugin file").required();
  info_command.calls([=, &globals] { *exit_code = info(globals, *id); });

  add_program(plugin, globals, kCheck);
}

}  // namespace cli
