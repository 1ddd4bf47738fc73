//! The questions of the page, as a table: a row says where a question stands and who may ask it, and has its handler.
//! What is asked and what is answered have types, which the page has as TypeScript; a test writes them.

use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value;
#[cfg(test)]
use ts_rs::TypeVisitor as _;

#[cfg(test)]
use super::page_type_tests::Declarations;
use super::parameters::read;
use epirig_server::{PostRules, Query, Refusal, RefusalKind, Reply};

/// How a question comes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Method {
    /// With all that it says in its address.
    Get,
    /// With JSON.
    Post,
}

/// A question as it came.
#[derive(Clone, Copy)]
pub(super) struct Asked<'a> {
    /// The parts of the path after `/api/`.
    pub(super) path: &'a [&'a str],
    /// What the address says behind the path.
    pub(super) query: &'a Query,
    /// What was sent with it.
    pub(super) json: &'a Value,
}

impl Asked<'_> {
    /// What was sent, with its type; a refusal begins with `unfit`.
    ///
    /// # Errors
    /// [`Refusal`] if something is missing, or is of another kind.
    pub(super) fn taken<T: DeserializeOwned>(&self, unfit: &str) -> Result<T, Refusal> {
        T::deserialize(self.json)
            .map_err(|error| Refusal::new(RefusalKind::Wrong, format!("{unfit}: {error}")))
    }
}

/// What the page has as a type, too. Only tests know it: they write the types of the page.
#[cfg(test)]
pub(super) trait OnPage: ts_rs::TS + 'static {}
#[cfg(test)]
impl<T: ts_rs::TS + 'static> OnPage for T {}
#[cfg(not(test))]
pub(super) trait OnPage {}
#[cfg(not(test))]
impl<T> OnPage for T {}

/// An answer that can be sent.
pub(super) trait Answer {
    /// Its type on the page.
    type Told: OnPage;

    /// What is sent.
    fn reply(self) -> Result<Reply, Refusal>;
}

/// A record, sent as JSON.
pub(super) struct Json<T>(pub(super) T);

impl<T: Serialize + OnPage> Answer for Json<T> {
    type Told = T;

    fn reply(self) -> Result<Reply, Refusal> {
        Reply::json(&self.0)
    }
}

/// A record and numbers behind it.
pub(super) struct Framed<T>(pub(super) T, pub(super) Vec<f32>);

impl<T: Serialize + OnPage> Answer for Framed<T> {
    type Told = T;

    fn reply(self) -> Result<Reply, Refusal> {
        Reply::framed(&self.0, &self.1)
    }
}

/// Nothing but that it was done.
impl Answer for () {
    type Told = ();

    fn reply(self) -> Result<Reply, Refusal> {
        Reply::json(&())
    }
}

/// A file, or numbers alone.
impl Answer for Reply {
    type Told = ();

    fn reply(self) -> Result<Reply, Refusal> {
        Ok(self)
    }
}

/// Answers a question about `S`.
type Handler<S> = dyn Fn(&S, Asked<'_>) -> Result<Reply, Refusal> + Send + Sync;

/// A question about `S`: a row of the table.
pub(super) struct Question<S> {
    method: Method,
    /// Parts in braces are names of what stands there; one with a star takes all parts that are left.
    path: &'static str,
    rules: PostRules,
    handler: Box<Handler<S>>,
    /// Tells which types the page needs for it.
    #[cfg(test)]
    pub(super) types: fn(&mut Declarations),
}

impl<S: 'static> Question<S> {
    pub(super) fn new(
        method: Method,
        path: &'static str,
        handler: impl Fn(&S, Asked<'_>) -> Result<Reply, Refusal> + Send + Sync + 'static,
    ) -> Self {
        Self {
            method,
            path,
            rules: PostRules::default(),
            handler: Box::new(handler),
            #[cfg(test)]
            types: |_| {},
        }
    }

    /// A question that is asked with a `Q` and answered with an `A`.
    pub(super) fn typed<Q: OnPage, A: Answer>(self) -> Self {
        Self {
            #[cfg(test)]
            types: |all| {
                all.visit::<Q>();
                all.visit::<A::Told>();
            },
            ..self
        }
    }

    /// A question whose address says it all: `Q` has what the braces of `path` and the query name.
    pub(super) fn get<Q: DeserializeOwned + OnPage, A: Answer>(
        path: &'static str,
        handler: impl Fn(&S, Q) -> Result<A, Refusal> + Send + Sync + 'static,
    ) -> Self {
        Self::new(Method::Get, path, move |site, asked| {
            let named = named(path, asked.path).unwrap_or_default();
            handler(site, read(&named, asked.query)?)?.reply()
        })
        .typed::<Q, A>()
    }

    /// A question that comes with JSON.
    pub(super) fn post<Q: DeserializeOwned + OnPage, A: Answer>(
        path: &'static str,
        handler: impl Fn(&S, Q) -> Result<A, Refusal> + Send + Sync + 'static,
    ) -> Self {
        Self::new(Method::Post, path, move |site, asked| {
            handler(site, asked.taken("the question is not understood")?)?.reply()
        })
        .typed::<Q, A>()
    }

    /// Whoever may look may ask this, too.
    pub(super) fn open(self) -> Self {
        Self { rules: PostRules { open_to_all: true, ..self.rules }, ..self }
    }

    /// It does not wait behind other work.
    pub(super) fn urgent(self) -> Self {
        Self { rules: PostRules { urgent: true, ..self.rules }, ..self }
    }

    /// It may come with so many bytes.
    pub(super) fn up_to(self, largest: usize) -> Self {
        Self { rules: PostRules { largest, ..self.rules }, ..self }
    }

    /// The same question, asked of a `T` in which `find` finds the `S` that it is about.
    pub(super) fn of<T, F: std::ops::Deref<Target = S>>(
        self,
        find: impl Fn(&T, Asked<'_>) -> Result<F, Refusal> + Send + Sync + 'static,
    ) -> Question<T> {
        let handler = self.handler;
        Question {
            method: self.method,
            path: self.path,
            rules: self.rules,
            handler: Box::new(move |site, asked| handler(&*find(site, asked)?, asked)),
            #[cfg(test)]
            types: self.types,
        }
    }
}

/// The parts of `path` that the braces of `pattern` name; `None` if the path is another one.
fn named(pattern: &'static str, path: &[&str]) -> Option<Vec<(&'static str, String)>> {
    let (mut found, mut rest) = (Vec::new(), path.iter());
    for part in pattern.split('/') {
        let name = part.strip_prefix('{').and_then(|part| part.strip_suffix('}'));
        match name.map(|name| (name, name.strip_suffix('*'))) {
            None if rest.next() == Some(&part) => {}
            None => return None,
            Some((_, Some(name))) => found.push((name, rest.by_ref().copied().collect::<Vec<_>>().join("/"))),
            Some((name, None)) => found.push((name, (*rest.next()?).to_owned())),
        }
    }
    rest.next().is_none().then_some(found)
}

/// All questions about `S`. Of two rows for one question the first counts.
pub(super) struct Questions<S>(pub(super) Vec<Question<S>>);

impl<S: 'static> Questions<S> {
    fn find(&self, method: Method, path: &[&str]) -> Option<&Question<S>> {
        self.0.iter().find(|row| row.method == method && named(row.path, path).is_some())
    }

    /// The answer to a question with all that it says in its address.
    ///
    /// # Errors
    /// [`Refusal`], also if there is no such question.
    pub(super) fn get(&self, site: &S, path: &[&str], query: &Query) -> Result<Reply, Refusal> {
        self.answer(site, Method::Get, Asked { path, query, json: &Value::Null })
    }

    /// The answer to a question with JSON.
    pub(super) fn post(&self, site: &S, path: &[&str], json: &Value) -> Result<Reply, Refusal> {
        self.answer(site, Method::Post, Asked { path, query: &Query::default(), json })
    }

    fn answer(&self, site: &S, method: Method, asked: Asked<'_>) -> Result<Reply, Refusal> {
        let row = self.find(method, asked.path).ok_or_else(|| Refusal::unknown(asked.path))?;
        (row.handler)(site, asked)
    }

    /// How what is posted here is taken.
    pub(super) fn rules(&self, path: &[&str]) -> PostRules {
        self.find(Method::Post, path).map_or_else(PostRules::default, |row| row.rules)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde::Deserialize;

    #[derive(Deserialize, ts_rs::TS)]
    struct Place {
        id: String,
        level: usize,
        kind: Option<String>,
    }

    type Names = std::collections::BTreeMap<String, String>;

    fn table() -> Questions<()> {
        Questions(vec![
            Question::get("maps/{id}/{level}", |_, Place { id, level, kind }| Ok(Json((id, level, kind)))),
            Question::get("files/{id*}", |_, asked: Names| Ok(Json(asked))),
            Question::post("stop", |_, asked: Names| Ok(Json(asked))).open().urgent().up_to(7),
        ])
    }

    fn got(path: &[&str], query: &str) -> Result<String, RefusalKind> {
        let reply = table().get(&(), path, &Query::parse(query)).map_err(|refusal| refusal.kind)?;
        Ok(String::from_utf8(reply.bytes).unwrap())
    }

    #[test]
    fn a_row_has_what_its_path_and_the_query_name() {
        assert_eq!(got(&["maps", "a", "3"], "").unwrap(), r#"["a",3,null]"#);
        assert_eq!(got(&["maps", "a", "3"], "kind=raw&more=1").unwrap(), r#"["a",3,"raw"]"#);
        assert_eq!(got(&["files", "a", "b"], "").unwrap(), r#"{"id":"a/b"}"#);
        for (path, query, kind) in [
            (&["maps", "a", "x"][..], "", RefusalKind::Wrong),
            (&["maps", "a"], "", RefusalKind::NotFound),
            (&["maps", "a", "3", "4"], "", RefusalKind::NotFound),
            (&["maps", "a", "3"], "level=4", RefusalKind::Wrong),
            (&["stop"], "", RefusalKind::NotFound),
        ] {
            assert_eq!(got(path, query), Err(kind), "{path:?} {query}");
        }
    }

    #[test]
    fn a_row_says_who_may_ask_and_how_much() {
        let table = table();
        let stop = PostRules { open_to_all: true, urgent: true, largest: 7 };
        assert_eq!(table.rules(&["stop"]), stop);
        assert_eq!(table.rules(&["files", "a"]), PostRules::default());
        assert_eq!(table.rules(&["go"]), PostRules::default());
    }
}
