#include "tests/faults/crashed_disk.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <random>
#include <set>
#include <vector>

namespace vantage::faults {
namespace {

using Kind = DiskStep::Kind;

// The root is node 0.
struct Node {
  bool is_folder = false;
  // Files.
  std::string synced;
  std::vector<const DiskStep*> since;  // writes and truncations
  // Folders.
  std::map<std::string, uint64_t> names;
  std::map<std::string, uint64_t> synced_names;
};

class Disk {
 public:
  Disk(const std::string& base, std::span<const DiskStep> steps) {
    nodes_[0].is_folder = true;
    if (!base.empty()) Read(base, 0);
    for (const DiskStep& step : steps) Take(step);
  }

  void Write(Unsynced unsynced, uint64_t seed, const std::string& to) {
    random_.seed(seed);
    WriteFolder(nodes_.at(0), unsynced, to);
  }

 private:
  static std::string NameOf(const std::string& path) {
    return path.substr(path.rfind('/') == std::string::npos ? 0 : path.rfind('/') + 1);
  }
  Node& FolderOf(const std::string& path) {
    uint64_t at = 0;
    for (size_t from = 0, slash = 0; (slash = path.find('/', from)) != std::string::npos;
         from = slash + 1) {
      at = nodes_.at(at).names.at(path.substr(from, slash - from));
    }
    return nodes_.at(at);
  }

  // What there was before the first step.
  void Read(const std::string& folder, uint64_t id) {
    for (const auto& entry : std::filesystem::directory_iterator(folder)) {
      const uint64_t child = next_known_++;
      Node& node = nodes_[child];
      node.is_folder = entry.is_directory();
      if (node.is_folder) {
        Read(entry.path().string(), child);
      } else {
        std::ifstream file(entry.path(), std::ios::binary);
        node.synced.assign(std::istreambuf_iterator<char>(file), {});
      }
      nodes_[id].names[entry.path().filename().string()] = child;
    }
    nodes_[id].synced_names = nodes_[id].names;
  }

  // The node that a step is about; one that was there before is known by its path at first.
  uint64_t IdOf(const DiskStep& step) {
    if (step.path.empty()) return 0;
    if (nodes_.count(step.node) == 0 && aliases_.count(step.node) == 0) {
      aliases_[step.node] = FolderOf(step.path).names.at(NameOf(step.path));
    }
    const auto alias = aliases_.find(step.node);
    return alias == aliases_.end() ? step.node : alias->second;
  }

  void Take(const DiskStep& step) {
    switch (step.kind) {
      case Kind::kCreateFile:
      case Kind::kMakeFolder:
        nodes_[step.node].is_folder = step.kind == Kind::kMakeFolder;
        FolderOf(step.path).names[NameOf(step.path)] = step.node;
        return;
      case Kind::kWrite:
      case Kind::kTruncate:
        nodes_[IdOf(step)].since.push_back(&step);
        return;
      case Kind::kSyncFile: {
        Node& file = nodes_[IdOf(step)];
        for (const DiskStep* change : file.since) Apply(*change, change->bytes.size(), file.synced);
        file.since.clear();
        return;
      }
      case Kind::kSyncFolder: {
        Node& folder = nodes_[IdOf(step)];
        folder.synced_names = folder.names;
        return;
      }
      case Kind::kRename: {
        const uint64_t id = IdOf(step);
        FolderOf(step.path).names.erase(NameOf(step.path));
        FolderOf(step.new_path).names[NameOf(step.new_path)] = id;
        return;
      }
      case Kind::kLink:
        FolderOf(step.new_path).names[NameOf(step.new_path)] = IdOf(step);
        return;
      case Kind::kRemove:
        FolderOf(step.path).names.erase(NameOf(step.path));
        return;
    }
  }

  // The first `size` bytes of a write, or a truncation.
  static void Apply(const DiskStep& change, size_t size, std::string& contents) {
    const auto offset = static_cast<size_t>(change.offset);
    if (change.kind == Kind::kTruncate) return contents.resize(offset);
    if (size == 0) return;
    if (contents.size() < offset + size) contents.resize(offset + size);
    std::copy_n(change.bytes.begin(), size, contents.begin() + static_cast<std::ptrdiff_t>(offset));
  }

  std::string ContentsOf(const Node& file, Unsynced unsynced) {
    std::string contents = file.synced;
    if (unsynced == Unsynced::kLost) return contents;
    for (size_t i = 0; i < file.since.size(); ++i) {
      const DiskStep& change = *file.since[i];
      size_t size = change.bytes.size();
      if (unsynced == Unsynced::kTorn) {
        const uint64_t chance = random_() % 3;
        if (chance == 0) continue;
        // A write in part: whole sectors are there, the rest is not.
        if (chance == 1 && i + 1 == file.since.size() && size > 0) size = random_() % size;
      }
      Apply(change, size, contents);
    }
    return contents;
  }

  std::map<std::string, uint64_t> NamesOf(const Node& folder, Unsynced unsynced) {
    if (unsynced == Unsynced::kKept) return folder.names;
    std::map<std::string, uint64_t> names = folder.synced_names;
    if (unsynced == Unsynced::kLost) return names;
    std::set<std::string> all;
    for (const auto& [name, node] : folder.names) all.insert(name);
    for (const auto& [name, node] : folder.synced_names) all.insert(name);
    for (const std::string& name : all) {
      if (random_() % 2 == 0) continue;
      const auto now = folder.names.find(name);
      if (now == folder.names.end()) {
        names.erase(name);
      } else {
        names[name] = now->second;
      }
    }
    return names;
  }

  void WriteFolder(const Node& folder, Unsynced unsynced, const std::string& to) {
    std::filesystem::create_directory(to);
    for (const auto& [name, id] : NamesOf(folder, unsynced)) {
      const Node& node = nodes_.at(id);
      const std::string path = to + "/" + name;
      if (node.is_folder) {
        WriteFolder(node, unsynced, path);
      } else {
        std::ofstream(path, std::ios::binary) << ContentsOf(node, unsynced);
      }
    }
  }

  std::map<uint64_t, Node> nodes_;
  std::map<uint64_t, uint64_t> aliases_;  // the recorder's numbers of what was there before
  uint64_t next_known_ = uint64_t{1} << 32;
  std::mt19937_64 random_;
};

}  // namespace

void MakeCrashedFolder(const std::string& base, std::span<const DiskStep> steps, Unsynced unsynced,
                       uint64_t seed, const std::string& to) {
  Disk(base, steps).Write(unsynced, seed, to);
}

}  // namespace vantage::faults
