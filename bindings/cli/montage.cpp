// deform montage: pictures of several runs in labeled rows. `make demo` calls it; it is not part of the
// command's promised surface.
#include <memory>

#include "arguments.h"
#include "messages.h"

#ifdef DEFORM_HAVE_RENDER
#include "render/render.h"
#endif

namespace cli {
namespace {

struct Options {
  std::vector<std::string> rows, columns;
  std::string out, title;
};

#ifdef DEFORM_HAVE_RENDER
int montage(const Options &options) {
  std::vector<std::vector<render::Image>> rows;
  std::vector<std::string> labels;
  // Each row reads LABEL FILE FILE ...; rows end where the next --row begins, which an empty word marks.
  bool begin = true;
  std::string why;
  for (const std::string &word : options.rows) {
    if (word.empty()) {
      begin = true;
    } else if (begin) {
      labels.push_back(word);
      rows.emplace_back();
      begin = false;
    } else {
      render::Image image;
      if (!render::read_png(word, image, &why)) return fail(why);
      rows.back().push_back(std::move(image));
    }
  }
  for (const auto &row : rows)
    if (row.empty()) return fail("montage: each --row is LABEL FILE...");
  const render::Image picture = render::montage(rows, labels, options.columns, options.title);
  if (!render::write_png(options.out, picture, &why)) return fail(why);
  return kDone;
}
#else
int montage(const Options &) { return fail("montage: this deform was built without the renderer"); }
#endif

}  // namespace

void add_montage(Command app, Globals &, int *exit_code) {
  auto options = std::make_shared<Options>();
  Command sub = app.command("montage", "pictures in labeled rows");
  sub.hide();
  sub.option("--row", options->rows, "LABEL FILE...; may be repeated")
      .required()
      .type_name("LABEL FILE...")
      .separated();
  sub.option("--columns", options->columns, "labels above the columns");
  sub.option("--title", options->title, "title");
  sub.option("--out", options->out, "picture to write (PNG)").required();
  sub.calls([=] { *exit_code = montage(*options); });
}

}  // namespace cli
