#include <windows.h>

#include <psapi.h>
#include <setjmp.h>

#include <cstring>
#include <new>
#include <string>

#include "check/watch.h"

namespace cli::check {

namespace pages {

size_t size() { return 4096; }

void *reserve(size_t bytes) {
  void *p = VirtualAlloc(nullptr, bytes, MEM_RESERVE | MEM_COMMIT, PAGE_NOACCESS);
  if (!p) throw std::bad_alloc();
  return p;
}

void release(void *begin, size_t) { VirtualFree(begin, 0, MEM_RELEASE); }

bool allow(void *begin, size_t bytes, Access access) {
  DWORD before;
  return VirtualProtect(begin, bytes,
                        access == Access::write  ? PAGE_READWRITE
                        : access == Access::read ? PAGE_READONLY
                                                 : PAGE_NOACCESS,
                        &before);
}

}  // namespace pages

namespace {

jmp_buf back_from_call, back_from_fault;

// Without a frame the way back unwinds nothing: what lies between is the plugin's.
#define DEFORM_SET_BACK(to) _setjmp(to, nullptr)

template <class T>
T *at_offset(HMODULE image, uint64_t offset) {
  return reinterpret_cast<T *>(reinterpret_cast<char *>(image) + offset);
}

const IMAGE_NT_HEADERS64 &header_of(HMODULE image) {
  return *at_offset<IMAGE_NT_HEADERS64>(image, uint64_t(at_offset<IMAGE_DOS_HEADER>(image, 0)->e_lfanew));
}

// The program, the library and the system's own libraries keep their entries.
bool is_ours(HMODULE image) {
  wchar_t name[32768], system[MAX_PATH];
  const std::wstring file(name, GetModuleFileNameW(image, name, DWORD(std::size(name))));
  const UINT n = GetSystemDirectoryW(system, MAX_PATH);
  return image == GetModuleHandleW(nullptr) || image == GetModuleHandleW(L"libdeform.dll") ||
         _wcsnicmp(file.c_str(), system, n) == 0;
}

}  // namespace

// ---- calls ------------------------------------------------------------------------------------------------

void Watch::find() {
  std::vector<HMODULE> images(1024);
  DWORD bytes = 0;
  EnumProcessModules(GetCurrentProcess(), images.data(), DWORD(images.size() * sizeof(HMODULE)), &bytes);
  images.resize(std::min<size_t>(images.size(), bytes / sizeof(HMODULE)));
  for (const HMODULE image : images) {
    if (is_ours(image)) continue;
    const auto &where = header_of(image).OptionalHeader.DataDirectory[IMAGE_DIRECTORY_ENTRY_IMPORT];
    if (!where.Size) continue;
    for (auto *from = at_offset<IMAGE_IMPORT_DESCRIPTOR>(image, where.VirtualAddress); from->Name; ++from) {
      auto *name = at_offset<IMAGE_THUNK_DATA64>(image, from->OriginalFirstThunk);
      auto *entry = at_offset<IMAGE_THUNK_DATA64>(image, from->FirstThunk);
      for (; from->OriginalFirstThunk && name->u1.AddressOfData; ++name, ++entry)
        if (!IMAGE_SNAP_BY_ORDINAL64(name->u1.Ordinal))
          look_at(reinterpret_cast<void **>(&entry->u1.Function),
                  at_offset<IMAGE_IMPORT_BY_NAME>(image, name->u1.AddressOfData)->Name);
    }
  }
}

void Watch::call(const std::function<void()> &f) {
  if (DEFORM_SET_BACK(back_from_call) == 0) f();
}

void Watch::stop(const char *name) {
  caught = name;
  longjmp(back_from_call, 1);
}

// ---- static variables -------------------------------------------------------------------------------------

void StaticsLocked::find(const void *inside) {
  HMODULE image = nullptr;
  GetModuleHandleExW(GET_MODULE_HANDLE_EX_FLAG_FROM_ADDRESS | GET_MODULE_HANDLE_EX_FLAG_UNCHANGED_REFCOUNT,
                     static_cast<LPCWSTR>(inside), &image);
  if (!image) return;
  base = reinterpret_cast<uintptr_t>(image);
  const IMAGE_NT_HEADERS64 &header = header_of(image);
  const IMAGE_SECTION_HEADER *section = IMAGE_FIRST_SECTION(&header);
  for (const auto *end = section + header.FileHeader.NumberOfSections; section < end; ++section) {
    if (!(section->Characteristics & IMAGE_SCN_MEM_WRITE)) continue;
    auto *const begin = at_offset<unsigned char>(image, section->VirtualAddress);
    ranges_.push_back({begin, begin + (section->Misc.VirtualSize + 4095) / 4096 * 4096});
  }
}

// ---- faults -----------------------------------------------------------------------------------------------

namespace {

[[noreturn]] void go_back() { longjmp(back_from_fault, 1); }

// The thread goes on at go_back, as if the plugin had called it.
LONG CALLBACK on_fault(EXCEPTION_POINTERS *at) {
  const EXCEPTION_RECORD &record = *at->ExceptionRecord;
  if (record.ExceptionCode != EXCEPTION_ACCESS_VIOLATION) return EXCEPTION_CONTINUE_SEARCH;
  Fenced::tell(reinterpret_cast<const void *>(record.ExceptionInformation[1]),
               record.ExceptionInformation[0] == 1 ? "writes" : "reads");
  at->ContextRecord->Rip = reinterpret_cast<DWORD64>(&go_back);
  at->ContextRecord->Rsp = ((at->ContextRecord->Rsp - 256) & ~DWORD64(15)) - 8;
  return EXCEPTION_CONTINUE_EXECUTION;
}

}  // namespace

void Fenced::call(const std::function<void()> &f) {
  void *const handler = AddVectoredExceptionHandler(1, on_fault);
  if (DEFORM_SET_BACK(back_from_fault) == 0) f();
  RemoveVectoredExceptionHandler(handler);
}

}  // namespace cli::check
