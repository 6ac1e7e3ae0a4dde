// Common to the subcommands of `deform mesh`: a quiet context with a mesh, and its report.
#pragma once
#include <string>
#include <vector>

#include "cli.h"
#include "messages.h"
#include "shown.h"

namespace cli {

// Warnings of the reader belong to the report of this command, so its context logs nothing by itself.
struct MeshSession {
  dfm_context *context = nullptr;
  dfm_mesh_handle mesh = 0;
  explicit MeshSession(const Globals &globals) {
    dfm_context_def def = dfm_context_def_default();
    def.threads = globals.threads;
    def.log = [](void *, int32_t, const char *) {};
    if (dfm_context_create(&def, &context) < 0) context = nullptr;
  }
  ~MeshSession() { dfm_context_destroy(context); }
  dfm_mesh_info info() const { return got<dfm_mesh_info>(dfm_mesh_get_info, mesh); }
  MeshSession(const MeshSession &) = delete;
  MeshSession &operator=(const MeshSession &) = delete;
};

// Reports the mesh of the session. asked: all that is known, as a table; else one line and, on stderr, the
// warnings. --json: everything. `notes` come with the warnings: what a conversion could not keep.
int report_mesh(const Globals &globals, const std::string &file, const MeshSession &session, bool show,
                const std::vector<std::string> &notes = {});

// Where `out` cannot hold how much of each cell is material, and the mesh knows it: the sentence about it.
std::string lost_shares(const dfm_mesh_info &cells, const std::string &out);
// A hint for a mesh longer than most bodies, whose file names no unit: it may be in millimeters. Else empty.
std::string unit_hint(const double lo[3], const double hi[3]);
std::vector<std::string> lines_of(const char *text);  // what the library's infos hold as one text
// whether a terminal hears how long it takes
inline bool show_progress(const Globals &globals) { return !globals.quiet && !globals.json; }

// How a file name ending is written: cells (.msh .msh2 .mesh), a surface (.obj .ply .stl .off) or either
// (.vtk .vtu, anything unknown).
enum class Writes { cells, surface, either };
Writes written_by(const std::string &path);
std::string mesh_ending(const std::string &path);  // lower case, without the dot

// Reads a surface of a format that the library leaves to assimp. False: its message is in `sentence`; true
// with session.mesh 0: not such a format.
bool import_surface(const std::string &path, MeshSession &session, std::string &sentence);

void add_mesh_fill(Command mesh, Globals &globals, int *exit_code);

}  // namespace cli
