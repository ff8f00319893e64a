// Output folders of commands, in which files of others are safe.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <set>
#include <span>
#include <string>
#include <vector>

namespace splitcubes::app {

/// The files that a command writes into a folder.
struct FolderKind {
    const char* name;                  // in the list of files
    const char* files;                 // for messages
    std::vector<const char*> folders;  // subfolders
    /// Returns whether a file of this name, relative to the folder, may belong to the command.
    bool (*is_own)(const std::filesystem::path&);
};

extern const FolderKind run_folder, pieces_folder, pictures_folder;

class Command;
/// Adds --force to a command that fills such a folder.
void add_force_option(Command& command, bool& force, const FolderKind& kind);

/// A folder with a list of the files that the program wrote into it, `splitcubes-files.txt`. Without `force`,
/// only listed files are ever removed or overwritten, and names are listed before their files are written, so
/// that files of a killed process are recognised. While the object lives no other process can create one for
/// the same folder (if the file system supports locks).
class OutputFolder {
  public:
    /// Creates the folder if it does not exist. Throws InputError if it cannot be created or written to; if
    /// another process writes into it; if it has files but no list, or an unlisted file with a name that may
    /// be written (unless `force`: such a file is replaced, the others stay); and in any case if a link, a
    /// folder or an input of the command has such a name.
    OutputFolder(std::filesystem::path folder, const FolderKind& kind, bool force,
                 std::span<const std::filesystem::path> read = {});

    const std::filesystem::path& path() const { return path_; }
    /// Returns whether a command that fills the folder may write a file of this path.
    bool may_write(const std::filesystem::path& file) const;

    /// Removes listed files, except those to keep, the temporary files that a killed process left in this
    /// folder and in listed ones, and the files that `force` replaces; files behind a symbolic link within
    /// the folder stay. To be called once, before the first add().
    void clear(const std::function<bool(const std::string&)>& keep);

    /// Lists a name, relative to the folder, creates its folders, and returns the file to write.
    std::filesystem::path add(const std::string& name);

  private:
    struct Descriptor {
        int value = -1;
        ~Descriptor();
    };
    /// Folders created by this object; removed with it if they are empty.
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
    void remove_leftovers(const std::string& folder) const;
    void append(const std::string& name);

    std::filesystem::path path_;
    const FolderKind& kind_;
    std::set<std::string> names_;                   // listed; those of folders end in '/'
    std::set<std::string> there_;                   // folders that add() need not create
    std::set<std::string> others_;                  // in a folder without a list
    std::set<std::string> replaced_;                // not listed, with names of own files
    std::map<std::string, std::string> immovable_;  // name and reason; not replaced even with `force`
    Descriptor list_;                               // of the list, to append to
    Descriptor lock_;                               // of the folder
    MadeFolders made_;
};

}  // namespace splitcubes::app
