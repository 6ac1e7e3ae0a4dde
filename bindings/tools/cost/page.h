// cost.html: the study on one page in one file, pictures included; needs no network and no script.
#pragma once
#include <string>

#include "study.h"

namespace cli::cost {

std::string page_html(const Subject &subject, const Study &study);
std::string escaped(const std::string &text);  // for HTML and SVG

}  // namespace cli::cost
