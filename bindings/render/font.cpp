// Text without a font library: each sign is a few strokes on a small grid, drawn with a round pen and soft
// edges, so that one table serves every size. Montage and legend are made of it.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "render.h"

namespace render {
namespace {

// Pairs of digits x, y: base line y = 2, capitals to 9, small letters to 7, tails to 0. A space starts a new
// stroke; ~ rounds a stroke's corners (quadratic B-spline: it starts and ends at its ends and touches the
// middle of each side between), closed where its ends meet.
struct Sign {
  char c;
  const char *strokes;
};
constexpr Sign kSigns[] = {{'A', "023962 1454"},
                           {'B', "0209 ~09494606 ~06565202"},
                           {'C', "~584909024253"},
                           {'D', "0209 ~092959522202"},
                           {'E', "59090252 0646"},
                           {'F', "590902 0646"},
                           {'G', "~584909025255 5535"},
                           {'H', "0209 5259 0656"},
                           {'I', "0209"},
                           {'J', "~3934321203"},
                           {'K', "0209 5905 1652"},
                           {'L', "090252"},
                           {'M', "0209356962"},
                           {'N', "02095259"},
                           {'O', "~0969620209"},
                           {'P', "0209 ~092959552505"},
                           {'Q', "~0969620209 4461"},
                           {'R', "0209 ~092959552505 2552"},
                           {'S', "~5849090655521203"},
                           {'T', "0969 3932"},
                           {'U', "~090502525559"},
                           {'V', "093269"},
                           {'W', "0922486289"},
                           {'X', "0952 5902"},
                           {'Y', "093569 3532"},
                           {'Z', "09590252"},
                           {'0', "~0959520209"},
                           {'1', "072922"},
                           {'2', "~0709595602 0252"},
                           {'3', "~0819595626 ~2656521203"},
                           {'4', "42490454"},
                           {'5', "590906 ~062757521203"},
                           {'6', "~58490904 ~0656520206"},
                           {'7', "095922"},
                           {'8', "~0959560609 ~0656520206"},
                           {'9', "~0959550509 ~57521203"},
                           {'a', "~0747420207 4742"},
                           {'b', "0902 ~0747420207"},
                           {'c', "~463707023243"},
                           {'d', "4942 ~0747420207"},
                           {'e', "0545 ~454707023243"},
                           {'f', "~39191712 0727"},
                           {'g', "~0747420207 ~4742401001"},
                           {'h', "0902 ~0507474542"},
                           {'i', "0702 0909"},
                           {'j', "~27212000 2929"},
                           {'k', "0902 4704 1542"},
                           {'l', "0902"},
                           {'m', "0702 ~0507373532 ~3537676562"},
                           {'n', "0702 ~0507474542"},
                           {'o', "~0747420207"},
                           {'p', "0700 ~0747420207"},
                           {'q', "4740 ~0747420207"},
                           {'r', "0702 ~050737"},
                           {'s', "~4637070544421203"},
                           {'t', "~19141232 0727"},
                           {'u', "~0704024244 4742"},
                           {'v', "072247"},
                           {'w', "0712365267"},
                           {'x', "0742 4702"},
                           {'y', "0722 4710"},
                           {'z', "07470242"},
                           {'.', "0202"},
                           {',', "1201"},
                           {':', "0202 0606"},
                           {';', "1201 1616"},
                           {'-', "0535"},
                           {'_', "0141"},
                           {'+', "0545 2723"},
                           {'=', "0646 0444"},
                           {'/', "0149"},
                           {'(', "~29070320"},
                           {')', "~09272300"},
                           {'[', "29090020"},
                           {']', "09292000"},
                           {'<', "480542"},
                           {'>', "084502"},
                           {'%', "0269 ~0929270709 ~4464624244"},
                           {'*', "2723 0644 0446"},
                           {'^', "072947"},
                           {'!', "0904 0202"},
                           {'?', "~081949462624 2222"},
                           {'\'', "0907"},
                           {'"', "0907 2927"},
                           {'#', "1219 3239 0444 0747"},
                           {'|', "0900"}};
constexpr const char *kUnknown = "0209595202";  // an empty frame
// a dot is a little thicker than a line
constexpr double kCapital = 7, kBaseLine = 2, kGap = 1.9, kBlank = 2.6, kPen = 0.46, kDot = 0.2;

struct Point { double x, y; };
using Stroke = std::vector<Point>;

Stroke rounded(const Stroke &corner) {
  const size_t n = corner.size();
  const bool closed = corner.front().x == corner.back().x && corner.front().y == corner.back().y;
  const auto middle = [](Point a, Point b) { return Point{(a.x + b.x) / 2, (a.y + b.y) / 2}; };
  Stroke out;
  const auto bend = [&](Point a, Point control, Point b) {
    for (int i = 0; i <= 8; ++i) {
      const double t = i / 8.0, u = 1 - t;
      out.push_back({u * u * a.x + 2 * u * t * control.x + t * t * b.x,
                     u * u * a.y + 2 * u * t * control.y + t * t * b.y});
    }
  };
  if (closed) {
    for (size_t i = 0; i + 1 < n; ++i) {
      const Point before = corner[(i + n - 2) % (n - 1)], at = corner[i], after = corner[i + 1];
      bend(middle(before, at), at, middle(at, after));
    }
  } else {
    for (size_t i = 1; i + 1 < n; ++i)
      bend(i == 1 ? corner[0] : middle(corner[i - 1], corner[i]), corner[i],
           i + 2 == n ? corner[i + 1] : middle(corner[i], corner[i + 1]));
  }
  return out;
}

std::vector<Stroke> strokes_of(char c) {
  const char *text = kUnknown;
  for (const Sign &s : kSigns)
    if (s.c == c) text = s.strokes;
  std::vector<Stroke> strokes;
  while (*text) {
    const bool soft = *text == '~';
    text += soft;
    Stroke s;
    for (; *text && *text != ' '; text += 2) s.push_back({double(text[0] - '0'), double(text[1] - '0')});
    strokes.push_back(soft ? rounded(s) : s);
    text += *text == ' ';
  }
  return strokes;
}

double advance(char c) {
  if (c == ' ') return kBlank + kGap;
  double right = 0;
  for (const Stroke &s : strokes_of(c))
    for (const Point &p : s) right = std::max(right, p.x);
  return right + kGap;
}

// std::hypot of three numbers: cli/plane.h says why.
double distance(Point p, Point a, Point b) {
  const double dx = b.x - a.x, dy = b.y - a.y, length = dx * dx + dy * dy;
  if (length == 0) return std::hypot(p.x - a.x, p.y - a.y, 0.0) - kDot;
  const double t = std::clamp(((p.x - a.x) * dx + (p.y - a.y) * dy) / length, 0.0, 1.0);
  return std::hypot(p.x - a.x - t * dx, p.y - a.y - t * dy, 0.0);
}

void blend(Image &picture, long x, long y, Color c, double cover) {
  if (x < 0 || y < 0 || x >= long(picture.width) || y >= long(picture.height)) return;
  uint8_t *p = &picture.rgb[(size_t(y) * picture.width + size_t(x)) * 3];
  const float rgb[3] = {c.r, c.g, c.b};
  for (int k = 0; k < 3; ++k) p[k] = uint8_t(std::lround(p[k] + cover * (255.0 * rgb[k] - p[k])));
}

void fill(Image &picture, long x0, long y0, long x1, long y1, Color c, double cover = 1) {
  for (long y = y0; y < y1; ++y)
    for (long x = x0; x < x1; ++x) blend(picture, x, y, c, cover);
}

void paste(Image &picture, const Image &part, uint32_t x0, uint32_t y0) {
  for (uint32_t y = 0; y < part.height; ++y)
    std::copy_n(part.rgb.begin() + std::ptrdiff_t(size_t(y) * part.width * 3), size_t(part.width) * 3,
                picture.rgb.begin() + std::ptrdiff_t((size_t(y0 + y) * picture.width + x0) * 3));
}

std::string number(double x) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", x);
  return text;
}

constexpr Color kInk{0.16f, 0.19f, 0.24f};

}  // namespace

double text_width(double size, const std::string &text) {
  double units = 0;
  for (const char c : text) units += advance(c);
  return text.empty() ? 0 : (units - kGap) * size / kCapital;
}

void draw_text(Image &picture, double x, double y, double size, const std::string &text, Color color) {
  const double scale = size / kCapital, pen = std::max(kPen * scale, 0.5);
  for (const char c : text) {
    const std::vector<Stroke> strokes = c == ' ' ? std::vector<Stroke>{} : strokes_of(c);
    const double wide = advance(c) * scale;
    for (long row = std::lround(y - 9 * scale); !strokes.empty() && row <= std::lround(y + 4 * scale); ++row)
      for (long column = std::lround(x - 2 * pen - 1); column <= std::lround(x + wide + pen); ++column) {
        double nearest = 1e9;
        const Point p{(double(column) + 0.5 - x) / scale, (y - double(row) - 0.5) / scale + kBaseLine};
        for (const Stroke &s : strokes)
          for (size_t i = 0; i + 1 < s.size(); ++i) nearest = std::min(nearest, distance(p, s[i], s[i + 1]));
        const double cover = std::clamp(pen + 0.5 - nearest * scale, 0.0, 1.0);
        if (cover > 0) blend(picture, column, row, color, cover);
      }
    x += wide;
  }
}

void legend(Image &picture, ColorMap map, double min, double max, const std::string &title,
            const std::string &unit) {
  const double size = std::max(8.0, picture.height / 46.0);
  const std::string head = unit.empty() ? title : title + " [" + unit + "]";
  const std::string low = number(min);
  const std::string high = number(max);
  const double words = std::max(text_width(size, head), text_width(size, low + "    " + high));
  const long wide = std::max(long(picture.width) / 5, std::lround(words));
  const long bar = std::lround(0.9 * size), pad = std::lround(1.1 * size), margin = std::lround(1.4 * size);
  const long box = std::lround(4.6 * size) + bar + pad;
  const long x0 = long(picture.width) - margin - wide - 2 * pad, y0 = long(picture.height) - margin - box;
  fill(picture, x0, y0, x0 + wide + 2 * pad, y0 + box, {1, 1, 1}, 0.72);
  const long x = x0 + pad, top = y0 + pad + std::lround(1.9 * size);
  draw_text(picture, double(x), double(y0 + pad) + size, size, head, kInk);
  for (long i = 0; i < wide; ++i)
    fill(picture, x + i, top, x + i + 1, top + bar, map_color(map, float(i) / float(std::max(wide - 1, 1L))));
  const double line = double(top + bar) + 1.8 * size;
  draw_text(picture, double(x), line, size, low, kInk);
  draw_text(picture, double(x + wide) - text_width(size, high), line, size, high, kInk);
}

Image montage(const std::vector<std::vector<Image>> &rows, const std::vector<std::string> &row_labels,
              const std::vector<std::string> &column_labels, const std::string &title) {
  uint32_t wide = 0, high = 0, columns = 0;
  for (const auto &row : rows) {
    columns = std::max(columns, uint32_t(row.size()));
    for (const Image &p : row) {
      wide = std::max(wide, p.width);
      high = std::max(high, p.height);
    }
  }
  Image all;
  if (columns == 0 || wide == 0 || high == 0) return all;
  const double size = std::clamp(high / 20.0, 8.0, 28.0);
  const uint32_t gap = uint32_t(std::lround(0.7 * size)), line = uint32_t(std::lround(2.6 * size));
  double longest = 0;
  for (const std::string &label : row_labels) longest = std::max(longest, text_width(size, label));
  const uint32_t left = gap + (longest > 0 ? uint32_t(std::ceil(longest)) + 2 * gap : 0);
  const uint32_t title_line = title.empty() ? 0 : uint32_t(std::lround(1.3 * line));
  const uint32_t top = gap + title_line + (column_labels.empty() ? 0 : line);
  all.width = left + columns * (wide + gap);
  all.height = top + uint32_t(rows.size()) * (high + gap);
  all.rgb.assign(size_t(all.width) * all.height * 3, 255);
  draw_text(all, left, gap + 1.6 * size, 1.3 * size, title, kInk);
  for (size_t c = 0; c < std::min<size_t>(column_labels.size(), columns); ++c) {
    const double middle = left + double(c) * (wide + gap) + 0.5 * wide;
    draw_text(all, middle - 0.5 * text_width(size, column_labels[c]), top - 0.9 * size, size,
              column_labels[c], kInk);
  }
  for (size_t r = 0; r < rows.size(); ++r) {
    const uint32_t y = top + uint32_t(r) * (high + gap);
    if (r < row_labels.size()) draw_text(all, 1.5 * gap, y + 0.5 * (high + size), size, row_labels[r], kInk);
    for (size_t c = 0; c < rows[r].size(); ++c) {
      const Image &p = rows[r][c];
      if (p.rgb.size() != size_t(p.width) * p.height * 3) continue;
      paste(all, p, left + uint32_t(c) * (wide + gap) + (wide - p.width) / 2, y + (high - p.height) / 2);
    }
  }
  return all;
}

}  // namespace render
