#include "reserved.hpp"

#include <algorithm>
#include <set>
#include <string>

namespace bf::codegen {

namespace {

/// Keywords and alternative tokens of C++17 to C++26 and of C23, and what generated code calls itself.
constexpr std::string_view keywords =
    "alignas alignof and and_eq asm auto bf bitand bitor bool break case catch char char16_t char32_t "
    "char8_t class co_await co_return co_yield compl concept const const_cast consteval constexpr "
    "constinit continue contract_assert decltype default delete do double dynamic_cast else enum "
    "explicit export extern false float for friend goto if inline int int16_t int32_t int8_t long main "
    "mutable namespace new noexcept not not_eq nullptr offsetof operator or or_eq private protected "
    "public register reinterpret_cast requires restrict return short signed sizeof static static_assert "
    "static_cast std struct switch template this thread_local throw true try typedef typeid typename "
    "typeof typeof_unqual uint16_t uint32_t uint8_t union unsigned using virtual void volatile wchar_t "
    "while xor xor_eq ";

/// Macros of the headers that generated code includes or that its users do, in GNU's and ARM's libraries.
constexpr std::string_view macros =
    "AF_DECnet BUFSIZ CSIGNAL E2BIG EACCES EADDRINUSE EADDRNOTAVAIL EADV EAFNOSUPPORT EAGAIN EALREADY "
    "EBADE EBADF EBADFD EBADMSG EBADR EBADRQC EBADSLT EBFONT EBUSY ECANCELED ECHILD ECHRNG ECOMM "
    "ECONNABORTED ECONNREFUSED ECONNRESET EDEADLK EDEADLOCK EDESTADDRREQ EDOM EDOTDOT EDQUOT EEXIST "
    "EFAULT EFBIG EFTYPE EHOSTDOWN EHOSTUNREACH EHWPOISON EIDRM EILSEQ EINPROGRESS EINTR EINVAL EIO "
    "EISCONN EISDIR EISNAM EKEYEXPIRED EKEYREJECTED EKEYREVOKED EL2HLT EL2NSYNC EL3HLT EL3RST ELIBACC "
    "ELIBBAD ELIBEXEC ELIBMAX ELIBSCN ELNRNG ELOOP EMEDIUMTYPE EMFILE EMLINK EMSGSIZE EMULTIHOP "
    "ENAMETOOLONG ENAVAIL ENETDOWN ENETRESET ENETUNREACH ENFILE ENOANO ENOBUFS ENOCSI ENODATA ENODEV "
    "ENOENT ENOEXEC ENOKEY ENOLCK ENOLINK ENOMEDIUM ENOMEM ENOMSG ENONET ENOPKG ENOPROTOOPT ENOSPC ENOSR "
    "ENOSTR ENOSYS ENOTBLK ENOTCONN ENOTDIR ENOTEMPTY ENOTNAM ENOTRECOVERABLE ENOTSOCK ENOTSUP ENOTTY "
    "ENOTUNIQ ENXIO EOF EOPNOTSUPP EOVERFLOW EOWNERDEAD EPERM EPFNOSUPPORT EPIPE EPROTO EPROTONOSUPPORT "
    "EPROTOTYPE ERANGE EREMCHG EREMOTE EREMOTEIO ERESTART ERFKILL EROFS ESHUTDOWN ESOCKTNOSUPPORT ESPIPE "
    "ESRCH ESRMNT ESTALE ESTRPIPE ETIME ETIMEDOUT ETOOMANYREFS ETXTBSY EUCLEAN EUNATCH EUSERS "
    "EWOULDBLOCK EXDEV EXFULL FIOGETOWN FIOSETOWN F_LOCK F_OK F_TEST F_TLOCK F_ULOCK HUGE_VAL HUGE_VALF "
    "INFINITY L_INCR L_SET L_XTND L_ctermid L_cuserid L_tmpnam MAXFLOAT MINSIGSTKSZ NAN NFDBITS NGREG "
    "NSIG NULL NZERO PF_DECnet POLLERR POLLHUP POLLIN POLLMSG POLLNVAL POLLOUT POLLPRI POLLRDBAND "
    "POLLRDHUP POLLRDNORM POLLREMOVE POLLWRBAND POLLWRNORM P_tmpdir R_OK SIGABRT SIGALRM SIGBUS SIGCHLD "
    "SIGCLD SIGCONT SIGFPE SIGHUP SIGILL SIGINT SIGIO SIGIOT SIGKILL SIGPIPE SIGPOLL SIGPROF SIGPWR "
    "SIGQUIT SIGRTMAX SIGRTMIN SIGSEGV SIGSTKFLT SIGSTKSZ SIGSTOP SIGSYS SIGTERM SIGTRAP SIGTSTP SIGTTIN "
    "SIGTTOU SIGURG SIGUSR1 SIGUSR2 SIGVTALRM SIGWINCH SIGXCPU SIGXFSZ SIOCATMARK SIOCGPGRP SIOCSPGRP "
    "SNAN SNANF SNANF128 SNANF32 SNANF32X SNANF64 SNANF64X SNANL SOMAXCONN WCONTINUED WEOF WEXITED "
    "WNOHANG WNOWAIT WSTOPPED WUNTRACED W_OK X_OK assert errno fd_set linux math_errhandling s6_addr "
    "s6_addr16 s6_addr32 sa_handler sa_sigaction sched_priority si_addr si_addr_lsb si_arch si_band "
    "si_call_addr si_fd si_int si_lower si_overrun si_pid si_pkey si_ptr si_status si_stime si_syscall "
    "si_timerid si_uid si_upper si_utime si_value sigcontext_struct sigev_notify_attributes "
    "sigev_notify_function signgam stderr stdin stdout strtodf tzname unix ACCESSPERMS ALLPERMS DEFFILEMODE "
    "FAPPEND FASYNC FFSYNC FNDELAY FNONBLOCK st_atime st_ctime st_mtime ";

/// What comes before the first '_' in macros of many words: SEEK_SET, INT8_MAX.
constexpr std::string_view families =
    "ADJ AF AIO ATOMIC BC BIG BOOL BUS BYTE CHAR CHARCLASS CLD CLK CLOCK CLOCKS CLONE CLOSE COLL CPU DBL "
    "DECIMAL DELAYTIMER ELF ESR EXIT EXPR EXTRA FD FILENAME FLT FOPEN FP FPE FPSIMD HAVE HOST HUGE ILL "
    "IN IN6ADDR INADDR INET INET6 INT INT16 INT32 INT64 INT8 INTMAX INTPTR IOV IP IPPROTO IPV6 ITIMER LC "
    "LDBL LINE LITTLE LLONG LOGIN LONG MADV MAP MATH MAX MB MCAST MCL MFD MLOCK MOD MQ MREMAP MS MSG "
    "NAME NGROUPS NL PATH PDP PF PIPE PKEY POLL POSIX PRIO PROT PTHREAD PTRDIFF RAND RE REG RENAME RLIM "
    "RLIM64 RLIMIT RTSIG RUSAGE SA SCHAR SCHED SCM SEEK SEGV SEM SHRT SHUT SI SIG SIGEV SIOCGSTAMP "
    "SIOCGSTAMPNS SIZE SO SOCK SOL SS SSIZE STA STDERR STDIN STDOUT SVE TIME TIMER TMP TRAP TTY UCHAR "
    "UINT UINT16 UINT32 UINT64 UINT8 UINTMAX UINTPTR ULLONG ULONG USHRT WCHAR WINT WORD XATTR ZA AT "
    "DN F FALLOC GRND LOCK O RWF RWH S SPLICE STATX SYNC UTIME ";

/// Keywords of Python, and modules of its library, which one of a model's name would hide.
constexpr std::string_view python =
    "False None True abc aifc antigravity argparse array as assert ast async asynchat asyncio asyncore "
    "atexit audioop await base64 bdb binascii bisect builtins bz2 cProfile calendar cgi cgitb chunk "
    "cmath cmd code codecs codeop collections colorsys compileall concurrent configparser contextlib "
    "contextvars copy copyreg crypt csv ctypes curses dataclasses datetime dbm decimal def del difflib "
    "dis distutils doctest elif email encodings ensurepip enum errno except faulthandler fcntl filecmp "
    "fileinput finally fnmatch fractions from ftplib functools gc genericpath getopt getpass gettext "
    "glob global graphlib grp gzip hashlib heapq hmac html http idlelib imaplib imghdr imp import "
    "importlib in inspect io ipaddress is itertools json keyword lambda lib2to3 linecache locale logging "
    "lzma mailbox mailcap marshal math mimetypes mmap modulefinder msilib msvcrt multiprocessing netrc "
    "nis nntplib nonlocal nt ntpath nturl2path numbers opcode operator optparse os ossaudiodev pass "
    "pathlib pdb pickle pickletools pipes pkgutil platform plistlib poplib posix posixpath pprint "
    "profile pstats pty pwd py_compile pyclbr pydoc pydoc_data pyexpat queue quopri raise random re "
    "readline reprlib resource rlcompleter runpy sched secrets select selectors shelve shlex shutil "
    "signal site smtpd smtplib sndhdr socket socketserver spwd sqlite3 sre_compile sre_constants "
    "sre_parse ssl stat statistics string stringprep struct subprocess sunau symtable sys sysconfig "
    "syslog tabnanny tarfile telnetlib tempfile termios textwrap this threading time timeit tkinter "
    "token tokenize tomllib trace traceback tracemalloc tty turtle turtledemo types typing unicodedata "
    "unittest urllib uu uuid venv warnings wave weakref webbrowser winreg winsound with wsgiref xdrlib "
    "xml xmlrpc yield zipapp zipfile zipimport zlib zoneinfo ";

using Words = std::set<std::string_view>;

Words words_of(std::string_view text) {
    Words words;
    for (std::size_t end = 0; (end = text.find(' ')) != text.npos; text.remove_prefix(end + 1))
        words.insert(text.substr(0, end));
    return words;
}

bool has_lower_case(std::string_view name) {
    return std::any_of(name.begin(), name.end(), [](char c) { return c >= 'a' && c <= 'z'; });
}

} // namespace

bool is_reserved(std::string_view name) {
    static const Words words = [] {
        Words all = words_of(keywords);
        all.merge(words_of(macros));
        return all;
    }();
    static const Words beginnings = words_of(families);
    if (words.contains(name)) return true;
    for (const std::string_view format : {"PRI", "SCN"}) // PRId64
        if (name.starts_with(format) && name.find_first_of("diouxX") == format.size()) return true;
    const auto beginning = name.substr(0, name.find('_'));
    if (beginning.size() == name.size()) return false;
    return beginning == "M" || beginning == "SYS" ||
           (beginnings.contains(beginning) && !has_lower_case(name));
}

bool is_reserved_for_files(std::string_view name) {
    static const Words words = words_of(python);
    // Functions and macros that end as those of a model do: timer_create, sem_destroy, si_value.
    static const Words libraries = words_of("cnd mtx sem si thrd timer tss ");
    return words.contains(name) || libraries.contains(name) || name.starts_with("pthread") ||
           name.starts_with("posix");
}

} // namespace bf::codegen
