#include "tests/cli/browser.hpp"

#include <sstream>

#include "tests/cli/program.hpp"

namespace kilvo::stories {
namespace {

/// The JSON inside of <script ... id="NAME">; null when there is none.
nlohmann::json json_element(const std::string& dom, const std::string& name) {
  const std::size_t element = dom.find("id=\"" + name + "\"");
  if (element == std::string::npos) return nullptr;
  const std::size_t begin = dom.find('>', element) + 1;
  return nlohmann::json::parse(dom.substr(begin, dom.find("</script>", begin) - begin), nullptr, false);
}

std::string lines_with(const std::string& text, const std::string& word) {
  std::istringstream in(text);
  std::string found;
  for (std::string line; std::getline(in, line);)
    if (line.find(word) != std::string::npos) found += line + "\n";
  return found;
}

}  // namespace

OpenedPage open_page(const std::filesystem::path& page) {
  const TemporaryFolder profile;
  const Finished f = run_program(
      KILVO_BROWSER,
      {"--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
       "--disable-component-update", "--disable-sync", "--host-resolver-rules=MAP * ~NOTFOUND", "--enable-logging=stderr", "--v=0",
       "--user-data-dir=" + profile.path().string(), "--window-size=1200,2000", "--dump-dom", "file://" + page.string()});
  return {f.code, f.out, lines_with(f.err, "CONSOLE"), json_element(f.out, "drawn"), json_element(f.out, "probe")};
}

OpenedPage open_narrow(const std::filesystem::path& page, int width) {
  std::string text = nlohmann::json(read_text(page)).dump();
  for (std::size_t at = text.find('<'); at != std::string::npos; at = text.find('<', at)) text.replace(at, 1, "\\u003c");
  const std::filesystem::path outer = page.string() + ".narrow.html";
  write_text(outer, "<!DOCTYPE html><body><iframe style='border: 0; width: " + std::to_string(width) +
                        "px; height: 900px'></iframe><script>const frame = document.querySelector('iframe'); frame.srcdoc = " + text +
                        R"(;
frame.onload = () => {
  const told = document.createElement('script');
  told.type = 'application/json';
  told.id = 'drawn';
  told.textContent = frame.contentDocument.getElementById('drawn').textContent;
  document.body.append(told);
};
</script>)");
  return open_page(outer);
}

OpenedPage open_and_probe(const std::filesystem::path& page, const std::string& script) {
  std::string html = read_text(page);
  const std::string probe = R"(<script>
function probe(found) { document.body.append(el('script', {type: 'application/json', id: 'probe'}, JSON.stringify(found))); }
function point(target, type, x, y, more) {
  const area = target.getBoundingClientRect();
  target.dispatchEvent(new PointerEvent(type, {clientX: area.left + x, clientY: area.top + y, pointerType: 'mouse', pointerId: 1, bubbles: true, ...more}));
}
Element.prototype.setPointerCapture = () => {};  // there is no real pointer to hold
)";
  html.insert(html.rfind("</body>"), probe + script + "</script>");
  const std::filesystem::path copy = page.string() + ".probe.html";
  write_text(copy, html);
  return open_page(copy);
}

}  // namespace kilvo::stories
