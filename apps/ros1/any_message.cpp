#include "apps/ros1/any_message.hpp"

namespace kilvo::ros1 {

const char* AnyText::value() { return "*"; }

}  // namespace kilvo::ros1
