// Folders that a command fills with files of its own, beside which other people's are safe.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <set>
#include <span>
#include <string>
#include <vector>

namespace splitcubes::app {

/// What a command writes into a folder.
struct FolderKind {
    const char* name;                  // in the list of files
    const char* files;                 // for messages
    std::vector<const char*> folders;  // within it
    /// Could a file of this name, relative to the folder, be such a one?
    bool (*is_own)(const std::filesystem::path&);
};

extern const FolderKind run_folder, pieces_folder, pictures_folder;

class Command;
/// --force, of a command that fills such a folder.
void add_force_option(Command& command, bool& force, const FolderKind& kind);

/// A folder with a list of what the program wrote into it, `splitcubes-files.txt`. Unless it is forced, only
/// what is listed is ever taken away or overwritten, and names are listed before their files are written: a
/// kill leaves nothing that is taken for somebody else's. While the object lives no other process can make
/// one for the same folder (where the file system has locks).
class OutputFolder {
  public:
    /// Makes the folder where it is not there. Throws InputError where it cannot be made or written to, where
    /// another process writes into it, where it has files and no list or one that is not listed has a name
    /// that may be written (unless `force`: such a one is replaced, the others stay), and, in any case, where
    /// a link, a folder or one of the files that the command reads has such a name.
    OutputFolder(std::filesystem::path folder, const FolderKind& kind, bool force,
                 std::span<const std::filesystem::path> read = {});

    const std::filesystem::path& path() const { return path_; }
    /// May a file of this path be written by a command that fills the folder?
    bool may_write(const std::filesystem::path& file) const;

    /// Takes listed files away and off the list, but for those that are to be kept, and what `force` is to
    /// replace; what lies behind a symbolic link within the folder stays. To be called once, before the first
    /// add().
    void clear(const std::function<bool(const std::string&)>& keep);

    /// Lists a name, relative to the folder, makes the folders that it is in, and returns the file to write.
    std::filesystem::path add(const std::string& name);

  private:
    struct Descriptor {
        int value = -1;
        ~Descriptor();
    };
    /// Those that have nothing in them go with it.
    struct MadeFolders {
        std::vector<std::filesystem::path> folders;  // outer before inner
        ~MadeFolders();
    };
    void make();
    void lock();
    bool read_list();
    void refuse_others() const;
    void find_named_alike(std::span<const std::filesystem::path> read);
    void look_at(const std::filesystem::path& file, std::span<const std::filesystem::path> read);
    bool is_own_folder(const std::filesystem::path& name) const;
    bool is_listed_file(const std::string& name) const;
    bool is_here(const std::filesystem::path& name) const;
    void remove_replaced();
    void append(const std::string& name);

    std::filesystem::path path_;
    const FolderKind& kind_;
    std::set<std::string> names_;                   // listed; those of folders end in '/'
    std::set<std::string> there_;                   // folders that add() need not make
    std::set<std::string> others_;                  // in a folder without a list
    std::set<std::string> replaced_;                // not listed, with names of own files
    std::map<std::string, std::string> immovable_;  // not even forced, and why
    Descriptor list_;                               // of the list, to append to
    Descriptor lock_;                               // of the folder
    MadeFolders made_;
};

}  // namespace splitcubes::app
