"""The pages of the documentation: folded, searched, with deep links, and all that they are given is text."""

from api.front.swagger import DocumentPage, redoc_page, swagger_page

FEW = DocumentPage("/docs", "A few", "/openapi/core.json")
ALL = DocumentPage("/docs/all", "All", "/openapi.json")


def text(shown: DocumentPage = FEW, root_path: str = "", assets: str = "/static") -> str:
    return bytes(swagger_page(shown, [shown, ALL], root_path, assets).body).decode()


def test_it_opens_folded_with_a_search_and_deep_links() -> None:
    page = text()
    assert 'url: "/openapi/core.json"' in page
    for option in ('docExpansion: "none"', "filter: true", "deepLinking: true", "opsFilter"):
        assert option in page
    assert 'src="/static/swagger-ui-bundle.js"' in page


def test_it_leads_to_the_other_pages_behind_a_proxy_too() -> None:
    page = text(root_path="/motion")
    assert '<a href="/motion/docs" aria-current="page">A few</a><a href="/motion/docs/all">All</a>' in page
    assert 'url: "/motion/openapi/core.json"' in page


def test_no_key_is_left_in_the_browser() -> None:
    assert "persistAuthorization" not in text()


def test_what_it_is_given_stays_text() -> None:
    hostile = DocumentPage('/"><b>', "<b>", '/"+alert(1)+"</script><b>')
    page = text(shown=hostile, assets='/"><b>')
    assert "<b>" not in page
    assert page.count("</script>") == 2
    assert r'url: "/\"+alert(1)+\"\u003c/script>\u003cb>"' in page


def test_redoc_shows_the_document_it_is_given_and_nothing_else() -> None:
    page = bytes(redoc_page("/motion/openapi.json", '/static"><b>').body).decode()
    assert '<redoc spec-url="/motion/openapi.json">' in page
    assert "<b>" not in page
    assert page.count("</script>") == 1
