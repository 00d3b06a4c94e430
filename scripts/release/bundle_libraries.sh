#!/bin/sh
# Copies the shared libraries that programs need, other than those of C and C++, into a folder beside
# them, where the programs find them wherever they are installed. Names get a hash, so that a
# process may hold another program's copy of the same library.
#   scripts/release/bundle_libraries.sh FOLDER FILE...
# FOLDER/licences gets the terms of the Debian packages that the libraries come from.
set -eu
for tool in patchelf ldd sha256sum dpkg-query; do
  command -v $tool >/dev/null || { echo "error: $tool is missing (apt-get install patchelf)" >&2; exit 2; }
done
folder=$1
shift
mkdir -p "$folder/licences"
ours=$(for file in "$@"; do basename "$file"; done)

# needed FILE: "name path" of every library behind it that is to be bundled.
needed() {
  ldd "$1" | while read -r name arrow path _; do
    [ "$arrow" = "=>" ] || continue
    case "$name" in
      libc.so.* | libm.so.* | libdl.so.* | libpthread.so.* | librt.so.* | libutil.so.* | libresolv.so.* | ld-linux*) continue ;;
      libstdc++.so.* | libgcc_s.so.*) continue ;;
    esac
    echo "$ours" | grep -qxF "$name" && continue
    [ "$path" != not ] || { echo "error: $1 needs $name, which is not installed here" >&2; exit 2; }
    echo "$name $path"
  done
}

list=$(for file in "$@"; do needed "$file"; done | sort -u)
renames=""
while read -r name path; do
  [ -n "$name" ] || continue
  new="${name%%.so*}-$(sha256sum "$path" | cut -c1-8).so${name#*.so}"
  cp -L "$path" "$folder/$new"
  chmod 755 "$folder/$new"
  patchelf --set-soname "$new" "$folder/$new"
  renames="$renames --replace-needed $name $new"
  package=$(dpkg-query -S "$(realpath "$path")" "$path" 2>/dev/null | head -1 | cut -d: -f1)
  cp -L "/usr/share/doc/$package/copyright" "$folder/licences/$package" 2>/dev/null ||
    echo "note: no licence found for $path"
done <<END
$list
END
# A call for each change: patchelf 0.14 loses a run path that comes with new names.
for file in "$@" "$folder"/*-????????.so*; do
  # shellcheck disable=SC2086  # a list of words
  patchelf $renames "$file"
  patchelf --add-rpath "\$ORIGIN/$(realpath --relative-to "$(dirname "$file")" "$folder")" "$file"
done
