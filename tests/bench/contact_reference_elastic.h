// The elastic half of contact_reference: Markdown tables of the model's own error.
#pragma once
#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace bench {
std::vector<std::pair<std::string, std::function<std::string()>>> elastic_tables();
}
