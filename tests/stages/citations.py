"""Whether what comments and pages cite is there: every `algorithm.md section 8, 'Targets'` names a
heading of core/algorithm.md, every `server/README.md, 'Errors'` a heading of that page, and every
relative link of a page leads to a file and, after a #, to a heading in it."""
import os
import re

ALGORITHM = 'core/algorithm.md'
# A citation may run over several lines of a comment or a page.
COMMENT = {'.h': r'//', '.cc': r'//', '.proto': r'//', '.py': r'#', '.sh': r'#', '.toml': r'#',
           '.yaml': r'#', '.cmake': r'#', '.txt': r'#', '.md': r''}
SECTION = re.compile(r"\b[Ss]ections? (\d+[A-Z]?(?:(?:,|,? and| to) \d+[A-Z]?)*)"
                     r"(?P<other> of the paper)?(?:, '(?P<name>[^']+)')?")
PAGE = re.compile(r"(?P<page>[\w./-]+\.md)`?, ['\"](?P<name>[^'\"]+)['\"]")
LINK = re.compile(r'\]\((?P<to>[^)\s]+)\)')


def joined(path, text):
    """The text without the line ends in its comments or paragraphs."""
    marker = COMMENT[os.path.splitext(path)[1]]
    return re.sub(rf'\n[ \t]*{marker}[ \t]*', ' ', text)


def headings(text):
    """Level and words of each heading of a page, those of its code blocks left out."""
    text = re.sub(r'^```.*?^```', '', text, flags=re.M | re.S)
    return [(len(marks), words.strip()) for marks, words in re.findall(r'^(#+) (.+)$', text, re.M)]


def anchors(text):
    """What links to a page's headings end in, as GitHub makes them."""
    found = set()
    for _, words in headings(text):
        anchor = re.sub(r'[^\w\- ]', '', words.lower()).replace(' ', '-')
        while anchor in found:
            anchor += '-1'
        found.add(anchor)
    return found


def sections(text):
    """The names below each numbered heading: '7A' lies in '7', too."""
    below, open_at = {}, []
    for level, words in headings(text):
        open_at = [(number, at) for number, at in open_at if at < level]
        for number, _ in open_at:
            below[number].add(words.lower())
        if match := re.match(r'(\d+[A-Z]?)\. ', words):
            below[match[1]] = set()
            open_at.append((match[1], level))
    return below


def read(path):
    with open(path, encoding='utf-8') as file:
        return file.read()


def wrong_sections(path, text, below):
    for match in SECTION.finditer(joined(path, text)):
        if match['other']:
            continue
        numbers = re.findall(r'\d+[A-Z]?', match[1])
        for number in numbers:
            if number not in below:
                yield f'{path}: {ALGORITHM} has no section {number}'
        name = match['name']
        if name and numbers[-1] in below and name.lower() not in below[numbers[-1]]:
            yield f"{path}: {ALGORITHM} section {numbers[-1]} has no heading '{name}'"


def wrong_pages(path, text):
    for match in PAGE.finditer(joined(path, text)):
        places = [match['page'], os.path.join(os.path.dirname(path), match['page'])]
        page = next((place for place in places if os.path.exists(place)), None)
        if page is None:
            yield f"{path}: there is no {match['page']}"
        elif match['name'] not in {words for _, words in headings(read(page))}:
            yield f"{path}: {page} has no heading '{match['name']}'"


def wrong_links(path, text):
    for match in LINK.finditer(re.sub(r'`[^`\n]*`', '', text)):
        to, _, anchor = match['to'].partition('#')
        if ':' in to:
            continue
        page = os.path.normpath(os.path.join(os.path.dirname(path), to)) if to else path
        if not os.path.exists(page):
            yield f'{path}: a link leads to {page}, which is not there'
        elif anchor and anchor not in anchors(read(page)):
            yield f'{path}: {page} has no heading for #{anchor}'


def wrong(paths):
    """What is cited and not there, in words. `paths` from the repository's folder."""
    below = sections(read(ALGORITHM))
    found = []
    for path in paths:
        if os.path.splitext(path)[1] not in COMMENT:
            continue
        text = read(path)
        found += wrong_sections(path, text, below)
        found += wrong_pages(path, text)
        if path.endswith('.md'):
            found += wrong_links(path, text)
    return found
