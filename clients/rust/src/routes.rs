//! Every route of the API. A test holds the list against the API's document, the compiler holds it against the methods.

use std::fmt::Display;

use reqwest::Method;

use crate::pages::percent_encoded;

/// One operation of the document.
pub(crate) struct Route {
    /// Its name in the document.
    #[cfg(test)]
    pub(crate) operation: &'static str,
    pub(crate) method: Method,
    /// With names in braces.
    pub(crate) path: &'static str,
}

impl Route {
    /// The path with the names filled in, in their order.
    pub(crate) fn with(&self, names: &[&str]) -> String {
        let mut path = String::new();
        let mut names = names.iter();
        for segment in self.path.split('/').skip(1) {
            path.push('/');
            match (segment.starts_with('{'), names.as_slice().first()) {
                (true, Some(name)) => {
                    path.push_str(&percent_encoded(name));
                    names.next();
                }
                _ => path.push_str(segment),
            }
        }
        path
    }
}

/// Parameters after the question mark.
#[derive(Default)]
pub(crate) struct Query(String);

impl Query {
    /// With one more parameter, when it is there.
    pub(crate) fn and(mut self, name: &str, value: Option<impl Display>) -> Self {
        if let Some(value) = value {
            self.0.push(if self.0.is_empty() { '?' } else { '&' });
            self.0.push_str(&format!("{name}={}", percent_encoded(&value.to_string())));
        }
        self
    }

    /// Appended to a path.
    pub(crate) fn after(&self, path: String) -> String {
        path + &self.0
    }
}

macro_rules! routes {
    ($($name:ident $operation:literal $method:ident $path:literal;)*) => {
        $(pub(crate) const $name: Route = Route {
            #[cfg(test)]
            operation: $operation,
            method: Method::$method,
            path: $path,
        };)*
        /// All of them.
        #[cfg(test)]
        pub(crate) const ALL: &[Route] = &[$($name),*];
    };
}

routes! {
ROUTES
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_parameters_are_escaped() {
        let route = Route { operation: "", method: Method::GET, path: "/v1/sites/{site}/runs/{run}/scans" };
        assert_eq!(route.with(&["a", "b/c"]), "/v1/sites/a/runs/b%2Fc/scans");
        let query = Query::default().and("a", Some("x y")).and("b", None::<u8>).and("c", Some(7));
        assert_eq!(query.after("/p".into()), "/p?a=x%20y&c=7");
    }
}
