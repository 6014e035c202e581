#!/bin/sh
# command_pages.sh VANTAGE HELP2MAN VERSION FOLDER: a manual page for each command of vantage, from
# what the program says of itself, into FOLDER, compressed.
set -eu
vantage=$1 help2man=$2 version=$3 folder=$4
rm -rf "$folder"
mkdir -p "$folder/programs"
"$vantage" completion commands >"$folder/programs/.commands"
tab=$(printf '\t')
while IFS=$tab read -r name words _; do
  page=vantage-$(echo "$name" | tr ' ' '-')
  # help2man calls a page after the program that it asks.
  printf '#!/bin/sh\nexec "%s" %s "$@"\n' "$vantage" "$name" >"$folder/programs/$page"
  chmod +x "$folder/programs/$page"
  {
    printf '[see also]\n.BR vantage (1),\n.BR vantaged (8)\n'
    printf '\n[exit status]\nas of\n.BR vantage (1)\n'
  } >"$folder/programs/$page.h2m"
  "$help2man" --no-info --no-discard-stderr --section=1 --name="$words" \
    --version-string="$version" --include="$folder/programs/$page.h2m" \
    --output="$folder/$page.1" "$folder/programs/$page"
  gzip --best --no-name --force "$folder/$page.1"
done <"$folder/programs/.commands"
rm -r "$folder/programs"
