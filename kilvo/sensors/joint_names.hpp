// The names of the joints in a message, shared by all messages that have the same: copying a sample copies no name.
#pragma once

#include <initializer_list>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace kilvo {

class JointNames {
 public:
  using List = std::vector<std::string>;

  JointNames() = default;
  JointNames(List names) : names_(names.empty() ? nullptr : std::make_shared<const List>(std::move(names))) {}
  JointNames(std::initializer_list<std::string> names) : JointNames(List(names)) {}

  const List& list() const {
    static const List none;
    return names_ ? *names_ : none;
  }
  operator const List&() const { return list(); }
  bool empty() const { return !names_; }
  std::size_t size() const { return list().size(); }
  auto begin() const { return list().begin(); }
  auto end() const { return list().end(); }
  const std::string& operator[](std::size_t i) const { return list()[i]; }

  friend bool operator==(const JointNames& a, const JointNames& b) { return a.names_ == b.names_ || a.list() == b.list(); }

 private:
  std::shared_ptr<const List> names_;  // never empty
};

}  // namespace kilvo
