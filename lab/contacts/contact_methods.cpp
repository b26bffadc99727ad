#include "lab/contacts/contact_methods.hpp"

#include <stdexcept>

#include "lab/contacts/paper_contacts.hpp"
#include "lab/contacts/simple_contacts.hpp"

namespace kilvo::lab {
namespace {

template <class Method>
std::unique_ptr<ContactDetector> make() {
  return std::make_unique<Method>();
}

}  // namespace

decltype(LegConfig::detector) contact_method(const std::string& name) {
  if (name == "kilvo") return nullptr;
  if (name == "paper") return make<PaperContactEstimator>;
  if (name == "variance") return make<VarianceContacts>;
  if (name == "force") return make<ForceContacts>;
  throw std::invalid_argument("legs.contact: '" + name + "' is none of kilvo, paper, variance, force");
}

}  // namespace kilvo::lab
